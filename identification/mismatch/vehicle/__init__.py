"""Diagnosis of a vehicle in water: which physics m xi' = -k2 |xi| xi + sum of the thrusters leaves out."""
