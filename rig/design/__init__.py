"""From a bench and a time to levels, order and dwells, as text, JSON and campaign file: `rig design`."""
