"""The analogue filter of a load cell's amplifier, before its converter."""

from __future__ import annotations

from collections.abc import Callable
from math import expm1


class LowPass:
    """First order, exact for a value that is held between two readings. Calling it is a conversion."""

    def __init__(self, read: Callable[[], float], time_constant: float, now: Callable[[], float]) -> None:
        """`time_constant` in s; 0: no filter. `now`: s."""
        self._read, self._tau, self._now = read, time_constant, now
        self._value: float | None = None
        self._at = 0.0

    def __call__(self) -> float:
        value, t = self._read(), self._now()
        if self._value is None or not self._tau:
            self._value = value
        else:
            self._value -= expm1(-(t - self._at) / self._tau) * (value - self._value)
        self._at = t
        return self._value
