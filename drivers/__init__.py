"""Wires: bytes to SI numbers and back. Knows no campaign, file or screen."""
