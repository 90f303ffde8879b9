"""Effects between the propeller and the load cell (stage `stand`, in N)."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import pi
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.filters import delayed, play, resonator
from sim_devices.world.history import History
from sim_devices.world.state import State


@dataclass(slots=True)
class StrutDrag:
    """Flow on the mounting: F + coefficient U|U|; a drag has a negative coefficient (flow from ahead pushes back)."""

    stage: ClassVar[Stage] = "stand"
    coefficient: float
    """N/(m/s)^2."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value + self.coefficient * s.flow * abs(s.flow)

    def over(self, value: Floats, h: History) -> Floats:
        return np.asarray(value + self.coefficient * h.flow * np.abs(h.flow))


@dataclass(slots=True)
class TorqueCrosstalk:
    """The cell feels the torque: form "even" F + coefficient n^2, form "torque" F + coefficient n|n|."""

    stage: ClassVar[Stage] = "stand"
    coefficient: float
    """N/(rev/s)^2."""
    form: str = "even"

    def __post_init__(self) -> None:
        require_choice("form", self.form, ("even", "torque"))

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value + self.coefficient * s.n * (s.n if self.form == "even" else abs(s.n))

    def over(self, value: Floats, h: History) -> Floats:
        return np.asarray(value + self.coefficient * h.n * (h.n if self.form == "even" else np.abs(h.n)))


@dataclass(slots=True)
class StandResonance:
    """Mass on a spring: y'' + 2 damping w y' + w^2 y = w^2 F, w = 2 pi frequency; y is what reaches the cell.

    Implicit midpoint in two substeps of the world's step: stable at every frequency, exact at rest.
    """

    stage: ClassVar[Stage] = "stand"
    frequency: float
    """Hz."""
    damping: float
    """relative to critical."""
    position: float = field(init=False, default=0.0)
    """N."""
    speed: float = field(init=False, default=0.0)
    """N/s."""

    def __post_init__(self) -> None:
        require_positive(frequency=self.frequency, damping=self.damping)

    def apply(self, value: float, _s: State, dt: float) -> float:
        w = 2.0 * pi * self.frequency
        h = dt / 2.0
        for _ in range(2):
            half = h / 2.0
            a = w * w
            c = 2.0 * self.damping * w
            v0 = self.speed
            mid = (v0 + half * a * (value - self.position)) / (1.0 + half * c + half * half * a)
            self.position += h * mid
            self.speed = 2.0 * mid - v0
        return self.position

    def over(self, value: Floats, h: History) -> Floats:
        return resonator(value, self.frequency, self.damping, h.dt)


@dataclass(slots=True)
class Hysteresis:
    """Friction or play in the load path: the play operator, y = min(max(y, F - width), F + width)."""

    stage: ClassVar[Stage] = "stand"
    width: float
    """N, half the play."""
    position: float = field(init=False, default=0.0)
    """N."""

    def __post_init__(self) -> None:
        require_positive(width=self.width)

    def apply(self, value: float, _s: State, _dt: float) -> float:
        self.position = min(max(self.position, value - self.width), value + self.width)
        return self.position

    def over(self, value: Floats, _h: History) -> Floats:
        return play(value, self.width)


STEP = 1e-3
"""s: the world's usual step."""


@dataclass(slots=True)
class TimeSkew:
    """The force arrives late: F(t - delay), of the step that this instant falls into, to half a millisecond."""

    stage: ClassVar[Stage] = "stand"
    delay: float
    """s."""
    line: deque[tuple[float, float]] = field(init=False, default_factory=deque)
    """(s, N) of the steps that are under way; they need not be even."""

    def __post_init__(self) -> None:
        require_positive(delay=self.delay)

    def apply(self, value: float, s: State, dt: float) -> float:
        self.line.append((s.t, value))
        while len(self.line) > 1 and self.line[0][0] < s.t - self.delay - 0.5 * min(dt, STEP):
            self.line.popleft()
        return self.line[0][1]

    def over(self, value: Floats, h: History) -> Floats:
        return delayed(value, self.delay, h.dt)
