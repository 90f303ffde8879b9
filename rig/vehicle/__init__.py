"""From trials of a vehicle and fits of its thrusters to drag, efficiency and inertia: `rig vehicle`."""
