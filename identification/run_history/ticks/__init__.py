"""A run's history and its rotor's dynamics in; what ticks of the command do within an interval out, row by row."""
