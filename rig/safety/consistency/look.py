"""What one tick of the control loop has of the motor and of the force, and means of it."""

from __future__ import annotations

from typing import NamedTuple


class Look(NamedTuple):
    """One tick. None: not measured on this bench, or nothing new in this tick."""

    time: float
    """s"""
    command: float | None
    """V, sent in the last tick; None: nothing was sent (the watchdog is being proved)."""
    rate: float | None
    """rev/s"""
    current: float | None
    """A"""
    thrust: float | None
    """N, raw: mean of the rows of this tick."""
    flowing: bool = False
    """Water moves past the propeller by itself: thrust then goes with the speed of advance as well."""


class Means(NamedTuple):
    """Over some tenths of a second of one command. None: too few values."""

    rate: float | None
    current: float | None
    thrust: float | None


RATE, CURRENT, THRUST = range(3)
"""Places in `Means`."""
UNITS = ("rev/s", "A", "N")
NAMES = ("the rotation rate", "the current", "the thrust")
DIGITS = (0.5, 0.5, 0.0)
"""What is smaller is no evidence, of coarse telemetry: a VESC tells 0.1 A and whole electrical rev/min."""
