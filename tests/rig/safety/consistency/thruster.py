"""A thruster as the consistency check sees it, tick by tick: its true curve, its lag, and what a sensor makes of it."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from rig.safety.consistency.look import Look
from rig.safety.consistency.watch import Consistency

TICK = 0.02
"""s"""
Spoil = Callable[[float, Look], Look]
"""(s, what is true) -> what is told."""


def truthful(_time: float, look: Look) -> Look:
    return look


@dataclass
class Thruster:
    """1 rev/s per volt, 0.4 N per n|n|, 0.035 A per n|n|, lag 0.1 s; a cell of 0.7 N at rest and 0.02 N of noise."""

    spoil: Spoil = truthful
    check: Consistency = field(default_factory=lambda: Consistency(0.5, 24.0))
    chance: random.Random = field(default_factory=lambda: random.Random(5))
    time: float = 0.0
    rate: float = 0.0
    astern: float = 1.0
    """Thrust of the other direction, as a share."""
    lag: float = 0.1
    """s"""
    flowing: bool = False

    def hold(self, volts: float | None, seconds: float) -> tuple[float, str] | None:
        """The command from now on; the first cause, and when it came."""
        for _ in range(round(seconds / TICK)):
            self.time += TICK
            self.rate += ((volts or 0.0) - self.rate) * TICK / self.lag
            turn = self.rate * abs(self.rate)
            thrust = 0.7 + 0.4 * turn * (self.astern if turn < 0 else 1.0) + self.chance.gauss(0.0, 0.02)
            rate = self.rate + self.chance.gauss(0.0, 0.005)
            true = Look(self.time, volts, rate, 0.035 * abs(turn), thrust, self.flowing)
            cause = self.check.advance(self.spoil(self.time, true))
            if cause:
                return self.time, cause
        return None

    def play(self, volts: tuple[float, ...], seconds: float = 3.0) -> tuple[float, str] | None:
        """A rest, then one level after the other."""
        for each in (0.0, *volts):
            found = self.hold(each, seconds)
            if found:
                return found
        return None


def from_then_on(begin: float, **told: Callable[[float], float]) -> Spoil:
    """What is told of these fields from `begin` s on."""

    def spoil(time: float, look: Look) -> Look:
        values = {name: change(getattr(look, name)) for name, change in told.items()}
        return look._replace(**values) if time >= begin else look

    return spoil
