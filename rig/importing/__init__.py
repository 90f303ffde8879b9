"""Turning other programs' tables and logs into recordings, by a map that states every assumption."""
