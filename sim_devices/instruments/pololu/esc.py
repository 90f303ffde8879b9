"""A speed controller for a pulse: what it makes of the width, and when it does not obey.

Source: Blue Robotics Basic ESC (1100 us full astern, 1500 us stop, 1900 us full ahead; neutral for some seconds until
it obeys, no signal for a while and it begins anew). It says nothing to anybody.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Esc:
    """us and s."""

    neutral: float = 1500.0
    dead_zone: float = 25.0
    """Of each side."""
    reach: float = 400.0
    """From neutral to full, each side."""
    arming: float = 2.0
    """Of neutral pulses before it obeys."""
    lost: float = 0.5
    """Without pulses, then it no longer obeys."""

    def share(self, pulse: float) -> float:
        """Of the supply voltage that the motor gets, with sign."""
        beyond = abs(pulse - self.neutral) - self.dead_zone
        share = min(max(beyond / (self.reach - self.dead_zone), 0.0), 1.0)
        return share if pulse > self.neutral else -share


class Arming:
    """Whether an ESC obeys by now."""

    def __init__(self, esc: Esc) -> None:
        self._esc = esc
        self._neutral = self._without = 0.0
        self.obeys = False

    def pass_time(self, pulse: float, dt: float) -> None:
        """`pulse` (us; 0: none) was there for dt (s)."""
        self._without = self._without + dt if pulse == 0.0 else 0.0
        if self._without >= self._esc.lost:
            self.obeys = False
        at_neutral = pulse != 0.0 and self._esc.share(pulse) == 0.0
        self._neutral = self._neutral + dt if at_neutral else 0.0
        self.obeys = self.obeys or self._neutral >= self._esc.arming
