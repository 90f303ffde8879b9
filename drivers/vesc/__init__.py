"""VESC motor controllers."""
