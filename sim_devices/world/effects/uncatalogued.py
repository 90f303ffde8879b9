"""Effects that stand in no catalogue: a diagnosis must say that it has no name for them. All stage `hydro`, in N.

Each is a relative change of the thrust of a shape of its own; `amount` is how much.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Effect, Floats, Stage, require_positive
from sim_devices.world.filters import changes
from sim_devices.world.history import History, instant
from sim_devices.world.state import State


@dataclass(slots=True)
class GainStep:
    """From `start` on the thrust is (1 + amount) times what it was: a blade tip lost, a cell knocked."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    start: float
    """s."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * (1.0 + self.amount) if s.t >= self.start else value

    def over(self, value: Floats, h: History) -> Floats:
        return np.where(h.t >= self.start, value * (1.0 + self.amount), value)


@dataclass(slots=True)
class ReversedFlowLoss:
    """T (1 - amount) while the tunnel flows backwards (U < 0): the strut's wake lies in the disc."""

    stage: ClassVar[Stage] = "hydro"
    amount: float

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * (1.0 - self.amount) if s.flow < 0.0 else value

    def over(self, value: Floats, h: History) -> Floats:
        return np.where(h.flow < 0.0, value * (1.0 - self.amount), value)


@dataclass(slots=True)
class CrossedFlowLoss:
    """T (1 - amount) while the thruster works against the flow, n U < 0: a ring vortex round the disc."""

    stage: ClassVar[Stage] = "hydro"
    amount: float

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * (1.0 - self.amount) if s.n * s.flow < 0.0 else value

    def over(self, value: Floats, h: History) -> Floats:
        return np.where(h.n * h.flow < 0.0, value * (1.0 - self.amount), value)


@dataclass(slots=True)
class TemperatureSquared:
    """T (1 - amount ((theta - reference)/span)^2) with theta the water's temperature."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    reference: float
    """degC."""
    span: float = 5.0
    """K."""

    def __post_init__(self) -> None:
        require_positive(span=self.span)

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * (1.0 - self.amount * ((s.water_temperature - self.reference) / self.span) ** 2)

    def over(self, value: Floats, h: History) -> Floats:
        return np.asarray(value * (1.0 - self.amount * ((h.water_temperature - self.reference) / self.span) ** 2))


@dataclass(slots=True)
class GainWave:
    """T (1 + amount sin(2 pi t / period + phase)): a tide, an air conditioner, a loose clamp that works."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    period: float
    """s."""
    phase: float = 0.0
    """rad."""

    def __post_init__(self) -> None:
        require_positive(period=self.period)

    def apply(self, value: float, s: State, _dt: float) -> float:
        return float(self.over(np.array([value]), instant(s))[0])

    def over(self, value: Floats, h: History) -> Floats:
        return np.asarray(value * (1.0 + self.amount * np.sin(2.0 * pi * h.t / self.period + self.phase)))


@dataclass(slots=True)
class LevelBump:
    """T (1 - amount exp(-((|n| - rate)/width)^2)): the blades sing at one rate."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    rate: float
    """rev/s."""
    width: float
    """rev/s."""

    def __post_init__(self) -> None:
        require_positive(width=self.width)

    def apply(self, value: float, s: State, _dt: float) -> float:
        return float(self.over(np.array([value]), instant(s))[0])

    def over(self, value: Floats, h: History) -> Floats:
        return np.asarray(value * (1.0 - self.amount * np.exp(-(((np.abs(h.n) - self.rate) / self.width) ** 2))))


@dataclass(slots=True)
class UpsweepLoss:
    """T (1 - amount) while the last change of |command| was upwards: flow that separates late and reattaches late."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    size: float = field(init=False, default=0.0)
    """V, |command| of the step before."""
    up: bool = field(init=False, default=False)

    def apply(self, value: float, s: State, _dt: float) -> float:
        now = abs(s.command)
        if now != self.size:
            self.up, self.size = now > self.size, now
        return value * (1.0 - self.amount) if self.up else value

    def over(self, value: Floats, h: History) -> Floats:
        size = np.abs(h.command)
        at = changes(size)
        up = np.diff(size[at], prepend=0.0) > 0.0
        return np.where(np.repeat(up, np.diff(np.append(at, size.size))), value * (1.0 - self.amount), value)


@dataclass(slots=True)
class WallEffect:
    """The forward jet meets a wall and clings above a rate: n > 0, T (1 - amount / (1 + e^-((n - rate)/width)))."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    rate: float
    """rev/s."""
    width: float
    """rev/s."""

    def __post_init__(self) -> None:
        require_positive(width=self.width)

    def apply(self, value: float, s: State, _dt: float) -> float:
        return float(self.over(np.array([value]), instant(s))[0])

    def over(self, value: Floats, h: History) -> Floats:
        attached = 0.5 * (1.0 + np.tanh(0.5 * (h.n - self.rate) / self.width))
        return np.where(h.n > 0.0, value * (1.0 - self.amount * attached), value)


@dataclass(slots=True)
class Fouling:
    """From `start` on weed gathers: T (1 - amount (1 - e^(-(t - start)/time_constant)))."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    start: float
    """s."""
    time_constant: float
    """s."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)

    def apply(self, value: float, s: State, _dt: float) -> float:
        return float(self.over(np.array([value]), instant(s))[0])

    def over(self, value: Floats, h: History) -> Floats:
        gathered = -np.expm1(-np.maximum(h.t - self.start, 0.0) / self.time_constant)
        return np.asarray(value * (1.0 - self.amount * gathered))


@dataclass(slots=True)
class ThermalDerating:
    """The drive gives less once the winding is `limit` warmer than the water: T (1 - amount), at once."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    limit: float
    """K."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * (1.0 - self.amount) if s.motor_rise > self.limit else value

    def over(self, value: Floats, h: History) -> Floats:
        return np.where(h.motor_rise > self.limit, value * (1.0 - self.amount), value)


@dataclass(slots=True)
class AerationPulses:
    """Air is drawn every `period` s for `length` s and takes the share `amount` of the thrust."""

    stage: ClassVar[Stage] = "hydro"
    amount: float
    period: float
    """s."""
    length: float
    """s."""

    def __post_init__(self) -> None:
        require_positive(period=self.period, length=self.length)

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * (1.0 - self.amount) if s.t % self.period >= self.period - self.length else value

    def over(self, value: Floats, h: History) -> Floats:
        return np.where(h.t % self.period >= self.period - self.length, value * (1.0 - self.amount), value)


UNCATALOGUED: dict[str, type[Effect]] = {
    "gain_step": GainStep,
    "reversed_flow_loss": ReversedFlowLoss,
    "crossed_flow_loss": CrossedFlowLoss,
    "temperature_squared": TemperatureSquared,
    "gain_wave": GainWave,
    "level_bump": LevelBump,
    "upsweep_loss": UpsweepLoss,
    "wall_effect": WallEffect,
    "fouling": Fouling,
    "thermal_derating": ThermalDerating,
    "aeration_pulses": AerationPulses,
}
