"""Effects of the water around the propeller (stage `hydro`, in N)."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import copysign, sqrt
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.filters import delayed, low_pass
from sim_devices.world.history import History
from sim_devices.world.square_law import square_law, square_law_step
from sim_devices.world.state import State


@dataclass(slots=True)
class InflowDynamics:
    """Water in the disc must be accelerated: T + C_t |n| share (n - u). u, the inflow in units of n, reaches n.

    So there is an overshoot after a step, and nothing at rest. form "first_order": u' = (n - u)/time_constant. form
    "momentum": rho A L g u' = T - 2 rho A u|u| (Bachmayer, Whitcomb and Grosenbaugh 2000, IEEE J. Oceanic Eng. 25(1)
    146-159), u' = (n|n| - u|u|)/(2 n_ref time_constant), which is `time_constant` for small changes at n_ref = k
    reference_voltage and longer below: 8 to 17 ms with a diameter of 76 mm, 40 to 80 ms with 300 mm at full drive.
    """

    stage: ClassVar[Stage] = "hydro"
    share: float
    time_constant: float
    """s."""
    form: str = "first_order"
    reference_voltage: float = 12.0
    """V; only for "momentum"."""
    inflow: float = field(init=False, default=0.0)
    """rev/s."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant, reference_voltage=self.reference_voltage)
        require_choice("form", self.form, ("first_order", "momentum"))

    def apply(self, value: float, s: State, dt: float) -> float:
        if self.form == "momentum":
            self.inflow = square_law_step(self.inflow, s.n, self._per_turn(s), dt)
        else:
            self.inflow += (s.n - self.inflow) * min(dt / self.time_constant, 1.0)
        return value + s.thrust_constant * abs(s.n) * self.share * (s.n - self.inflow)

    def over(self, value: Floats, h: History) -> Floats:
        if self.form == "momentum":
            inflow = square_law(h.n, self._per_turn(h), h.dt)
        else:
            inflow = low_pass(h.n, self.time_constant, h.dt)
        return np.asarray(value + h.thrust_constant * np.abs(h.n) * self.share * (h.n - inflow))

    def _per_turn(self, s: State | History) -> float:
        """1/rev."""
        return 1.0 / (2.0 * s.rate_per_volt * self.reference_voltage * self.time_constant)


@dataclass(slots=True)
class SpeedOfAdvance:
    """Tunnel flow through the disc: T - coefficient |n| U."""

    stage: ClassVar[Stage] = "hydro"
    coefficient: float
    """N/((rev/s)(m/s))."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value - self.coefficient * abs(s.n) * s.flow

    def over(self, value: Floats, h: History) -> Floats:
        return np.asarray(value - self.coefficient * np.abs(h.n) * h.flow)


@dataclass(slots=True)
class Recirculation:
    """The jet comes round the tunnel: T - coefficient |n| u, u' = (j - u)/time_constant.

    form "rate": the jet j is n. form "thrust": j = sgn(T) sqrt(|T| / C_t), momentum theory's jet of the thrust itself.
    form "late": j is n of `delay` ago, the time that the water takes round the tunnel. form "circuit": j follows n with
    the same time constant first, in a volume of water of its own.
    """

    stage: ClassVar[Stage] = "hydro"
    coefficient: float
    """N/(rev/s)^2."""
    time_constant: float
    """s."""
    form: str = "rate"
    delay: float = 10.0
    """s; only for "late"."""
    way: deque[float] = field(init=False, default_factory=deque)
    """rev/s, what is under way."""
    jet: float = field(init=False, default=0.0)
    """rev/s: u."""
    first: float = field(init=False, default=0.0)
    """rev/s: j of "circuit"."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)
        require_choice("form", self.form, ("rate", "thrust", "late", "circuit"))

    def apply(self, value: float, s: State, dt: float) -> float:
        if self.form == "late":
            self.way.append(s.n)
            made = self.way.popleft() if len(self.way) > round(self.delay / dt) else self.way[0]
        elif self.form == "circuit":
            self.first += (s.n - self.first) * min(dt / self.time_constant, 1.0)
            made = self.first
        else:
            made = s.n if self.form == "rate" else copysign(sqrt(abs(value) / s.thrust_constant), value)
        self.jet += (made - self.jet) * min(dt / self.time_constant, 1.0)
        return value - self.coefficient * abs(s.n) * self.jet

    def over(self, value: Floats, h: History) -> Floats:
        if self.form == "thrust":
            made = np.sign(value) * np.sqrt(np.abs(value) / h.thrust_constant)
        elif self.form == "circuit":
            made = low_pass(h.n, self.time_constant, h.dt)
        else:
            made = h.n if self.form == "rate" else delayed(h.n, self.delay, h.dt)
        return np.asarray(value - self.coefficient * np.abs(h.n) * low_pass(made, self.time_constant, h.dt))


@dataclass(slots=True)
class ThrusterInteraction:
    """A neighbour's jet is the water that this propeller meets: T - loss sqrt(C_t) |n| sqrt|T_j|, signed as the jet.

    Momentum theory: a thrust T_j blows a jet of U_j = sqrt(2 |T_j| / (rho A)), of which a part that depends on the
    place arrives, and a flow from ahead takes C_s |n| U (Nienhuis 1992, Analysis of thruster effectivity; Dang and
    Laheij 2004, section 5.2). `loss` is so scaled that of two equal thrusts 1 - loss is left: 0.37, 0.57 and 0.74 in
    line at 2, 5 and 10 diameters (the rule of ABS, 1 - 0.75^((x/D)^(2/3))). At small n the jet takes more than the
    thrust. The neighbour runs for `on_time` out of every `period` seconds.
    """

    stage: ClassVar[Stage] = "hydro"
    loss: float
    neighbour_thrust: float
    """N, while it runs; positive: its jet comes from ahead."""
    period: float = 60.0
    """s."""
    on_time: float = 30.0
    """s."""

    def __post_init__(self) -> None:
        require_positive(period=self.period)

    def apply(self, value: float, s: State, _dt: float) -> float:
        runs = s.t % self.period >= self.period - self.on_time
        return value - self._per_rate(s.thrust_constant) * abs(s.n) if runs else value

    def over(self, value: Floats, h: History) -> Floats:
        runs = h.t % self.period >= self.period - self.on_time
        return np.asarray(value - runs * self._per_rate(h.thrust_constant) * np.abs(h.n))

    def _per_rate(self, thrust_constant: float) -> float:
        """N/(rev/s) that are lost while it runs."""
        jet = copysign(sqrt(abs(self.neighbour_thrust)), self.neighbour_thrust)
        return self.loss * sqrt(thrust_constant) * jet
