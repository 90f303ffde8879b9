"""From recordings of thrusters to their models, as text, JSON and page: `rig fit`."""
