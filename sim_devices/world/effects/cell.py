"""Effects of the load cell and its amplifier (stages `cell` and `output`, in N)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, sqrt
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_positive
from sim_devices.world.filters import low_pass
from sim_devices.world.history import History
from sim_devices.world.state import State


@dataclass(slots=True)
class LoadCellCreep:
    """Viscoelastic cell: F + share * c, c' = (F - c)/time_constant; with share_2 a second, slower term beside it."""

    stage: ClassVar[Stage] = "cell"
    share: float
    time_constant: float
    """s."""
    share_2: float = 0.0
    time_constant_2: float = 300.0
    """s."""
    crept: float = field(init=False, default=0.0)
    """N."""
    crept_2: float = field(init=False, default=0.0)
    """N."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant, time_constant_2=self.time_constant_2)

    def apply(self, value: float, _s: State, dt: float) -> float:
        self.crept += (value - self.crept) * min(dt / self.time_constant, 1.0)
        self.crept_2 += (value - self.crept_2) * min(dt / self.time_constant_2, 1.0)
        return value + self.share * self.crept + self.share_2 * self.crept_2

    def over(self, value: Floats, h: History) -> Floats:
        crept = self.share * low_pass(value, self.time_constant, h.dt)
        if self.share_2:
            crept += self.share_2 * low_pass(value, self.time_constant_2, h.dt)
        return np.asarray(value + crept)


@dataclass(slots=True)
class LoadCellNonlinearity:
    """Cell not straight: F + quadratic F|F| + cubic F^3."""

    stage: ClassVar[Stage] = "cell"
    quadratic: float = 0.0
    """1/N."""
    cubic: float = 0.0
    """1/N^2."""

    def apply(self, value: float, _s: State, _dt: float) -> float:
        return value + self.quadratic * value * abs(value) + self.cubic * value**3

    def over(self, value: Floats, _h: History) -> Floats:
        return np.asarray(value + self.quadratic * value * np.abs(value) + self.cubic * value**3)


@dataclass(slots=True)
class LoadCellEvenBend:
    """Cell whose pull and push do not mirror each other: F + coefficient F^2, of one sign in both directions."""

    stage: ClassVar[Stage] = "cell"
    coefficient: float
    """1/N."""

    def apply(self, value: float, _s: State, _dt: float) -> float:
        return value + self.coefficient * value**2

    def over(self, value: Floats, _h: History) -> Floats:
        return np.asarray(value + self.coefficient * value**2)


@dataclass(slots=True)
class ZeroDrift:
    """Cell or amplifier warms: + amplitude (1 - e^(-t/time_constant)) + rate t + root sqrt(t), t from `start` on.

    The root is heat that diffuses into a thick body.
    """

    stage: ClassVar[Stage] = "cell"
    amplitude: float = 0.0
    """N."""
    time_constant: float = 300.0
    """s."""
    rate: float = 0.0
    """N/s."""
    root: float = 0.0
    """N/s^0.5."""
    start: float = 0.0
    """s of world time."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)

    def apply(self, value: float, s: State, _dt: float) -> float:
        t = max(s.t - self.start, 0.0)
        return value + self.amplitude * (1.0 - exp(-t / self.time_constant)) + self.rate * t + self.root * sqrt(t)

    def over(self, value: Floats, h: History) -> Floats:
        t = np.maximum(h.t - self.start, 0.0)
        warmed = self.amplitude * (1.0 - np.exp(-t / self.time_constant))
        return np.asarray(value + warmed + self.rate * t + self.root * np.sqrt(t))


@dataclass(slots=True)
class ZeroOffset:
    """The zero jumps at `start` (a knock, a cable that pulls) and stays: + offset from then on."""

    stage: ClassVar[Stage] = "cell"
    offset: float
    """N."""
    start: float = 0.0
    """s of world time; 0: a tare error of the whole run."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value + self.offset if s.t >= self.start else value

    def over(self, value: Floats, h: History) -> Floats:
        return np.where(h.t >= self.start, value + self.offset, value)
