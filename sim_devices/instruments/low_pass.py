"""The analogue filter of a load cell's amplifier, before its converter."""

from __future__ import annotations

from math import expm1


class LowPass:
    """First order; it is there all the time, however seldom it is read."""

    def __init__(self, time_constant: float) -> None:
        """`time_constant` in s; 0: no filter."""
        self._tau = time_constant
        self._settled = False
        self.value = 0.0

    def follow(self, value: float, dt: float) -> None:
        """`value` stood before it for dt (s): exact. It has settled at the first."""
        share = -expm1(-dt / self._tau) if self._tau and self._settled else 1.0
        self.value += share * (value - self.value)
        self._settled = True
