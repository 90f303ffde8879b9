"""From recordings of a vehicle in water to a diagnosis: what m xi' = -k2 |xi| xi + sum of the thrusters leaves out."""
