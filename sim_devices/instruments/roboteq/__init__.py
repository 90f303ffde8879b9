"""A Roboteq controller, as it answers lines."""
