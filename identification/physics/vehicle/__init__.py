"""What m xi' = -k2 |xi| xi + sum of the thrusters may leave out: one effect of a vehicle in water per file."""
