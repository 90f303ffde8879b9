"""Effects of the load cell and its amplifier (stages `cell` and `output`, in N)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, pi, sin
from typing import ClassVar

from sim_devices.world.effects.stage import Stage, require_positive
from sim_devices.world.state import State


@dataclass(slots=True)
class LoadCellCreep:
    """Viscoelastic cell: F + share * c, c' = (F - c)/time_constant."""

    stage: ClassVar[Stage] = "cell"
    share: float
    time_constant: float
    """s."""
    crept: float = field(init=False, default=0.0)
    """N."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)

    def apply(self, value: float, _s: State, dt: float) -> float:
        self.crept += (value - self.crept) * min(dt / self.time_constant, 1.0)
        return value + self.share * self.crept


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


@dataclass(slots=True)
class PeriodicDisturbance:
    """Pick-up, mains or blade pass: + amplitude sin(2 pi p + phase).

    p' = frequency, or with `blades` p' = blades |n| (then the line stands still with the rotor and is silent).
    """

    stage: ClassVar[Stage] = "cell"
    amplitude: float
    """N."""
    frequency: float = 0.0
    """Hz; not used with blades."""
    blades: int = 0
    phase: float = 0.0
    """rad."""
    turns: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        if (self.frequency > 0) == (self.blades > 0):
            raise ValueError("give either frequency (Hz) or blades, not both and not neither")

    def apply(self, value: float, s: State, dt: float) -> float:
        if self.blades:
            self.turns = (self.turns + self.blades * abs(s.n) * dt) % 1.0
            if abs(s.n) < 0.1:  # rev/s: stands still
                return value
        else:
            self.turns = (self.turns + self.frequency * dt) % 1.0
        return value + self.amplitude * sin(2.0 * pi * self.turns + self.phase)


@dataclass(slots=True)
class ZeroDrift:
    """Cell or amplifier warms: + amplitude (1 - e^(-t/time_constant)) + rate t."""

    stage: ClassVar[Stage] = "cell"
    amplitude: float = 0.0
    """N."""
    time_constant: float = 300.0
    """s."""
    rate: float = 0.0
    """N/s."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value + self.amplitude * (1.0 - exp(-s.t / self.time_constant)) + self.rate * s.t


@dataclass(slots=True)
class LoadCellSaturation:
    """Cell or amplifier clips, noise and all: clip(reading, -limit, limit)."""

    stage: ClassVar[Stage] = "output"
    limit: float
    """N."""

    def __post_init__(self) -> None:
        require_positive(limit=self.limit)

    def apply(self, value: float, _s: State, _dt: float) -> float:
        return min(max(value, -self.limit), self.limit)
