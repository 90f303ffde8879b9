"""Pololu controllers, as they take packets."""
