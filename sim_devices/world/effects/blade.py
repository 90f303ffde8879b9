"""Effects on the thrust of the propeller itself (stage `hydro`, in N)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp
from typing import ClassVar

from sim_devices.world.effects.stage import Stage, require_positive
from sim_devices.world.state import State


@dataclass(slots=True)
class Exponent:
    """Thrust grows as |V|^exponent: T (|n| / n_ref)^(exponent - 2), equal to C V|V| at reference_voltage."""

    stage: ClassVar[Stage] = "hydro"
    exponent: float
    reference_voltage: float = 12.0
    """V where both laws agree."""

    def __post_init__(self) -> None:
        require_positive(exponent=self.exponent, reference_voltage=self.reference_voltage)

    def apply(self, value: float, s: State, _dt: float) -> float:
        ratio = abs(s.n) / (s.rate_per_volt * self.reference_voltage)
        return float(value * ratio ** (self.exponent - 2.0)) if ratio > 0.0 else 0.0


@dataclass(slots=True)
class Asymmetry:
    """A blade built for one direction: C- = ratio * C+, C+ unchanged."""

    stage: ClassVar[Stage] = "hydro"
    ratio: float

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * self.ratio if s.n < 0.0 else value


@dataclass(slots=True)
class LinearTerm:
    """Thrust + coefficient * V, with V = n / k at rest of the rotor equation."""

    stage: ClassVar[Stage] = "hydro"
    coefficient: float
    """N/V."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value + self.coefficient * s.n / s.rate_per_volt


@dataclass(slots=True)
class Cavitation:
    """Thrust breaks down above a rate: T (1 - slope max(|n| - onset, 0)), never below zero."""

    stage: ClassVar[Stage] = "hydro"
    onset: float
    """rev/s."""
    slope: float
    """1/(rev/s)."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        excess = abs(s.n) - self.onset
        return value * max(1.0 - self.slope * excess, 0.0) if excess > 0.0 else value


@dataclass(slots=True)
class Heating:
    """Winding and magnet warm up: T (1 - loss_per_kelvin * rise); the rise is the motor's own (thruster table)."""

    stage: ClassVar[Stage] = "hydro"
    loss_per_kelvin: float
    """1/K."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * (1.0 - self.loss_per_kelvin * s.motor_rise)


@dataclass(slots=True)
class ReversalLoss:
    """The wake met at a sign change: T (1 - loss e^(-t/time_constant)), t since the rotor turned the other way.

    The wake left behind dies at rest with the same time constant.
    """

    stage: ClassVar[Stage] = "hydro"
    loss: float
    time_constant: float
    """s."""
    direction: float = field(init=False, default=0.0)
    wake: float = field(init=False, default=0.0)
    """0..1: how much of the opposing wake is still there."""
    rest: float = field(init=False, default=0.0)
    """s since the rotor last turned."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)

    def apply(self, value: float, s: State, dt: float) -> float:
        self.wake *= exp(-dt / self.time_constant)
        if abs(s.n) < 0.5:  # rev/s: too slow to make or meet a wake
            self.rest += dt
            return value * (1.0 - self.loss * self.wake)
        turning = 1.0 if s.n > 0.0 else -1.0
        if turning != self.direction:
            met = self.direction != 0.0
            self.wake = exp(-self.rest / self.time_constant) if met else 0.0
            self.direction = turning
        self.rest = 0.0
        return value * (1.0 - self.loss * self.wake)
