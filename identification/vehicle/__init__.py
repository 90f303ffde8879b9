"""From the trials of a whole vehicle to its drag, efficiency, current, buoyancy and inertia."""
