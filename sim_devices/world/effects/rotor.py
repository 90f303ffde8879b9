"""Effects between the voltage and the rotation rate (stage `rotor`, in rev/s)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp, pi, sin
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.filters import low_pass
from sim_devices.world.history import History
from sim_devices.world.square_law import square_law, square_law_step
from sim_devices.world.state import State


@dataclass(slots=True)
class MotorLag:
    """Rotor inertia. The rest point stays n = k V.

    form "first_order": n' = (k V - n)/time_constant. form "quadratic": n' = beta V|V| - alpha n|n| with
    beta = alpha k^2 (thesis equation 4.14), alpha = 1 / (2 n_ref time_constant), so that `time_constant` is the one of
    small changes at the rate n_ref = k reference_voltage. form "two_lags": the drive's current and the rotor one after
    the other, time_constant / 2 each.
    """

    stage: ClassVar[Stage] = "rotor"
    time_constant: float
    """s."""
    form: str = "first_order"
    reference_voltage: float = 12.0
    """V; only for "quadratic"."""
    n: float = field(init=False, default=0.0)
    """rev/s."""
    driven: float = field(init=False, default=0.0)
    """rev/s, after the first of two lags."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant, reference_voltage=self.reference_voltage)
        require_choice("form", self.form, ("first_order", "quadratic", "two_lags"))

    def apply(self, value: float, s: State, dt: float) -> float:
        before = self.n
        if self.form == "first_order":
            self.n = value + (before - value) * exp(-dt / self.time_constant)
        elif self.form == "two_lags":
            self._two_lags(value, dt)
        else:
            self.n = square_law_step(before, value, self._alpha(s.rate_per_volt), dt)
        s.acceleration = (self.n - before) / dt
        return self.n

    def over(self, value: Floats, h: History) -> Floats:
        if self.form == "first_order":
            n = low_pass(value, self.time_constant, h.dt)
        elif self.form == "two_lags":
            n = low_pass(low_pass(value, self.time_constant / 2.0, h.dt), self.time_constant / 2.0, h.dt)
        else:
            n = square_law(value, self._alpha(h.rate_per_volt), h.dt)
        h.acceleration = np.diff(n, prepend=0.0) / h.dt
        return n

    def _two_lags(self, target: float, dt: float) -> None:
        """Exact for a held target: d = n - target decays as (d + (driven - target) t/T) e^(-t/T)."""
        t = dt / (self.time_constant / 2.0)
        ahead = self.driven - target
        self.n = target + (self.n - target + ahead * t) * exp(-t)
        self.driven = target + ahead * exp(-t)

    def _alpha(self, rate_per_volt: float) -> float:
        """1/rev."""
        return 1.0 / (2.0 * rate_per_volt * self.reference_voltage * self.time_constant)


@dataclass(slots=True)
class RotationCoupling:
    """The rotor does not keep to k V: n (1 + amplitude w(t)), w three slow sines of incommensurate periods, |w| <= 1.

    Thrust follows n. A controller that hunts, a propeller that picks up weed and loses it again.
    """

    stage: ClassVar[Stage] = "rotor"
    amplitude: float
    """relative."""
    period: float = 20.0
    """s of the slowest sine; the others have 0.382 and 0.618 of it."""
    phase: float = 0.0
    """rad."""

    def __post_init__(self) -> None:
        require_positive(period=self.period)

    def apply(self, value: float, s: State, _dt: float) -> float:
        wave = sum(sin(2.0 * pi * s.t / (self.period * r) + self.phase / r) for r in PERIODS) / len(PERIODS)
        return value * (1.0 + self.amplitude * wave)

    def over(self, value: Floats, h: History) -> Floats:
        waves = [np.sin(2.0 * pi * h.t / (self.period * r) + self.phase / r) for r in PERIODS]
        return np.asarray(value * (1.0 + self.amplitude * np.mean(waves, axis=0)))


PERIODS = (1.0, 0.618, 0.382)
"""Relative to the slowest: powers of the golden ratio, so that the sum does not repeat."""
