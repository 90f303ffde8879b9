"""Effects of the water around the propeller (stage `hydro`, in N)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from sim_devices.world.effects.stage import Stage, require_positive
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


@dataclass(slots=True)
class SpeedOfAdvance:
    """Tunnel flow through the disc: T - coefficient |n| U."""

    stage: ClassVar[Stage] = "hydro"
    coefficient: float
    """N/((rev/s)(m/s))."""

    def apply(self, value: float, s: State, _dt: float) -> float:
        return value - self.coefficient * abs(s.n) * s.flow


@dataclass(slots=True)
class Recirculation:
    """The jet comes round the tunnel: T - coefficient |n| u, u' = (n - u)/time_constant."""

    stage: ClassVar[Stage] = "hydro"
    coefficient: float
    """N/(rev/s)^2."""
    time_constant: float
    """s."""
    jet: float = field(init=False, default=0.0)
    """rev/s."""

    def __post_init__(self) -> None:
        require_positive(time_constant=self.time_constant)

    def apply(self, value: float, s: State, dt: float) -> float:
        self.jet += (s.n - self.jet) * min(dt / self.time_constant, 1.0)
        return value - self.coefficient * abs(s.n) * self.jet


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
