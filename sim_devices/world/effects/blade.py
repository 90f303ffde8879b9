"""Effects on the thrust of the propeller itself (stage `hydro`, in N)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import copysign, exp
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.history import History
from sim_devices.world.state import State

TURNING = 0.5
"""rev/s: slower than this the rotor neither makes nor meets a wake."""


@dataclass(slots=True)
class Exponent:
    """Thrust grows as |V|^exponent, equal to C V|V| at reference_voltage.

    form "propeller": the water does it, T (|n| / n_ref)^(exponent - 2). form "drive": the drive holds something else
    than a voltage, and rate and current follow: V_eff = V_ref (|V| / V_ref)^(exponent / 2), so that the thrust has the
    exponent 2 where it holds the rate, 1 the torque or the current, 2/3 the power (Smogeli 2006, Control of marine
    propellers, NTNU 2006:187: speed, torque and power control; T ~ n^2, Q ~ n^2, P ~ n^3).
    """

    exponent: float
    reference_voltage: float = 12.0
    """V where both laws agree."""
    form: str = "propeller"

    def __post_init__(self) -> None:
        require_positive(exponent=self.exponent, reference_voltage=self.reference_voltage)
        require_choice("form", self.form, ("propeller", "drive"))

    @property
    def stage(self) -> Stage:
        return "hydro" if self.form == "propeller" else "command"

    def apply(self, value: float, s: State, _dt: float) -> float:
        if self.form == "drive":
            return copysign(
                self.reference_voltage * (abs(value) / self.reference_voltage) ** (self.exponent / 2), value
            )
        ratio = abs(s.n) / (s.rate_per_volt * self.reference_voltage)
        return float(value * ratio ** (self.exponent - 2.0)) if ratio > 0.0 else 0.0

    def over(self, value: Floats, h: History) -> Floats:
        if self.form == "drive":
            share = np.abs(value / self.reference_voltage)
            return np.asarray(np.copysign(self.reference_voltage * share ** (self.exponent / 2), value))
        ratio = np.abs(h.n) / (h.rate_per_volt * self.reference_voltage)
        turning = ratio > 0.0
        gain = np.power(ratio, self.exponent - 2.0, where=turning, out=np.zeros_like(ratio))
        return np.asarray(value * gain)


@dataclass(slots=True)
class Asymmetry:
    """A blade built for one direction: C- = ratio * C+, C+ unchanged."""

    stage: ClassVar[Stage] = "hydro"
    ratio: float

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value * self.ratio if s.n < 0.0 else value

    def over(self, value: Floats, h: History) -> Floats:
        return np.where(h.n < 0.0, value * self.ratio, value)


@dataclass(slots=True)
class LinearTerm:
    """Thrust + coefficient * V, with V = n / k at rest of the rotor equation."""

    stage: ClassVar[Stage] = "hydro"
    coefficient: float
    """N/V."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value + self.coefficient * s.n / s.rate_per_volt

    def over(self, value: Floats, h: History) -> Floats:
        return np.asarray(value + self.coefficient * h.n / h.rate_per_volt)


@dataclass(slots=True)
class Cavitation:
    """Thrust breaks down above a rate, never below zero; e = max(|n| - onset, 0).

    form "linear": T (1 - slope e). form "square": T (1 - (slope e)^2), which sets in gently. form "exponential":
    T e^(-slope e).
    """

    stage: ClassVar[Stage] = "hydro"
    onset: float
    """rev/s."""
    slope: float
    """1/(rev/s)."""
    form: str = "linear"

    def __post_init__(self) -> None:
        require_choice("form", self.form, ("linear", "square", "exponential"))

    def apply(self, value: float, s: State, _dt: float) -> float:
        lost = self.slope * max(abs(s.n) - self.onset, 0.0)
        if self.form == "exponential":
            return value * exp(-lost)
        return value * max(1.0 - (lost if self.form == "linear" else lost * lost), 0.0)

    def over(self, value: Floats, h: History) -> Floats:
        lost = self.slope * np.maximum(np.abs(h.n) - self.onset, 0.0)
        if self.form == "exponential":
            return np.asarray(value * np.exp(-lost))
        return np.asarray(value * np.maximum(1.0 - (lost if self.form == "linear" else lost * lost), 0.0))


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
        if abs(s.n) < TURNING:
            self.rest += dt
            return value * (1.0 - self.loss * self.wake)
        turning = 1.0 if s.n > 0.0 else -1.0
        if turning != self.direction:
            met = self.direction != 0.0
            self.wake = exp(-self.rest / self.time_constant) if met else 0.0
            self.direction = turning
        self.rest = 0.0
        return value * (1.0 - self.loss * self.wake)

    def over(self, value: Floats, h: History) -> Floats:
        turning = np.flatnonzero(np.abs(h.n) >= TURNING)
        wake = np.zeros_like(value)
        turned = np.flatnonzero(np.diff(np.sign(h.n[turning]))) + 1  # positions in `turning` of a new direction
        ends = [*turning[turned[1:]].tolist(), value.size]
        for position, end in zip(turned.tolist(), ends[: turned.size], strict=True):
            at = turning[position]
            met = exp(-(at - turning[position - 1] - 1) * h.dt / self.time_constant)
            wake[at:end] = met * np.exp(-(h.t[at:end] - h.t[at]) / self.time_constant)
        return np.asarray(value * (1.0 - self.loss * wake))
