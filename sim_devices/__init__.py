"""A world to measure and instruments that speak real bytes, written apart from the rig on purpose."""
