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
from sim_devices.world.state import State


@dataclass(slots=True)
class InflowDynamics:
    """Water in the duct must be accelerated: T + C_t |n| share (n - u), u' = (n - u)/time_constant.

    Overshoot after a step, nothing at rest: u is the inflow in units of n and reaches it.
    """

    stage: ClassVar[Stage] = "hydro"
    share: float
    time_constant: float
    """s."""
    inflow: float = field(init=False, default=0.0)
    """rev/s."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)

    def apply(self, value: float, s: State, dt: float) -> float:
        self.inflow += (s.n - self.inflow) * min(dt / self.time_constant, 1.0)
        return value + s.thrust_constant * abs(s.n) * self.share * (s.n - self.inflow)

    def over(self, value: Floats, h: History) -> Floats:
        inflow = low_pass(h.n, self.time_constant, h.dt)
        return np.asarray(value + h.thrust_constant * np.abs(h.n) * self.share * (h.n - inflow))


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
    """A neighbour runs: T (1 - loss |T_j| / thrust_scale); it runs for `on_time` out of every `period` seconds."""

    stage: ClassVar[Stage] = "hydro"
    loss: float
    neighbour_thrust: float
    """N, while it runs."""
    thrust_scale: float = 100.0
    """N."""
    period: float = 60.0
    """s."""
    on_time: float = 30.0
    """s."""

    def __post_init__(self) -> None:
        require_positive(period=self.period, thrust_scale=self.thrust_scale)

    def apply(self, value: float, s: State, _dt: float) -> float:
        runs = s.t % self.period >= self.period - self.on_time
        return value * (1.0 - self.loss * abs(self.neighbour_thrust) / self.thrust_scale) if runs else value

    def over(self, value: Floats, h: History) -> Floats:
        runs = h.t % self.period >= self.period - self.on_time
        return np.asarray(value * (1.0 - runs * self.loss * abs(self.neighbour_thrust) / self.thrust_scale))
