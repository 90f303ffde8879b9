"""What the simulated vehicle is made of. SI; surge ahead, sway and yaw to starboard, heave down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import copysign

AXES = ("surge", "sway", "heave", "yaw")


@dataclass(frozen=True, slots=True)
class Body:
    """One axis: (inertia) a = -linear v - quadratic |v| v + force (thesis eq. 4.13), v through the water."""

    inertia: float
    """kg, for yaw kg.m^2; added mass included."""
    linear: float
    """N/(m/s), N.m/(rad/s)."""
    quadratic: float
    """N/(m/s)^2, N.m/(rad/s)^2."""
    astern: float = 1.0
    """Factor of the quadratic drag while it moves backwards through the water."""

    def __post_init__(self) -> None:
        if (
            not (self.inertia > 0 and self.astern > 0)
            or min(self.linear, self.quadratic) < 0
            or self.linear + self.quadratic == 0
        ):
            raise ValueError(f"Body: inertia must be above 0, drag not negative and not absent, got {self}")


@dataclass(frozen=True, slots=True)
class Mounted:
    """One thruster and its place."""

    C: float
    """N/V^2 in open water."""
    arms: Mapping[str, float]
    """axis -> N (N.m for yaw) on the vehicle per N of thrust."""
    hull_side: int = 0
    """Sign of the voltage at which its jet meets the hull; 0: at neither."""
    partner: str = ""
    """The thruster on the same side whose jet and its own disturb each other; empty: none."""


@dataclass(frozen=True, slots=True)
class Hull:
    """The whole vehicle."""

    name: str
    axes: Mapping[str, Body]
    thrusters: Mapping[str, Mounted]
    eta_hull: float = 1.0
    """Share of the thrust left when the jet meets the hull (propeller-hull interaction)."""
    eta_pair: float = 1.0
    """Share left to each of two thrusters of one side that run together (propeller-propeller interaction)."""
    current: tuple[float, float] = (0.0, 0.0)
    """m/s, uniform current towards north and east."""
    buoyancy: float = 0.0
    """N downwards beside the ballast of a trial: negative when the vehicle floats."""
    dead_band: float = 0.0
    """V below which no thruster turns; beyond it only the rest of the voltage acts."""
    motor_lag: float = 0.0
    """s, time constant with which each thruster's rate follows its voltage."""
    tether: float = 0.0
    """N/(m/s)^2 of drag for each m that the line is paid out: from the start of a trial, in heave from the surface."""
    wander: float = 0.0
    """N (N.m), standard deviation of a slow force from the cable, anew in each hold."""
    noise: Mapping[str, float] = field(
        # an acoustic fix of 0.07 m is the thesis's own figure (4.2.3); a depth-meter of 5 mm and a gyro of 5 mrad
        # are assumptions
        default_factory=lambda: {"position": 0.07, "depth": 0.005, "heading": 0.005}
    )

    def acting(self, V: float) -> float:
        """What the dead band leaves of a voltage."""
        return copysign(max(abs(V) - self.dead_band, 0.0), V)

    def thrust(self, name: str, volts: Mapping[str, float]) -> float:
        """N of one thruster as installed, all of them at `volts`."""
        own, V = self.thrusters[name], self.acting(volts.get(name, 0.0))
        force = own.C * V * abs(V)
        if own.hull_side * V > 0:
            force *= self.eta_hull
        if V != 0 and own.partner and self.acting(volts.get(own.partner, 0.0)) != 0:
            force *= self.eta_pair
        return force

    def force(self, axis: str, volts: Mapping[str, float]) -> float:
        """N (N.m) of all thrusters on an axis."""
        return sum(
            self.thrusters[name].arms.get(axis, 0.0) * self.thrust(name, volts) for name, V in volts.items() if V
        )
