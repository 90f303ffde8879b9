"""From positions to velocities, and from velocities of steady runs to a linear drag."""
