"""From the rows of a fleet to one page: which thrusters left their limits, since when, and what they hide."""
