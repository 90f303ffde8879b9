"""What a world is made of, as read from `world.toml`. All SI; rotation rates in rev/s."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sim_devices.tables import WorldError, build, check_known
from sim_devices.world.effects import EFFECTS, Effect
from sim_devices.world.effects.uncatalogued import UNCATALOGUED
from sim_devices.world.noise import CHANNELS, Noise


@dataclass(frozen=True, slots=True)
class Thruster:
    """`[thrusters.<name>]`: one motor with its propeller.

    Rotor: n' = drive - alpha n|n| with drive = alpha (k V)|k V| + stiffness (k V - n), whose rest point is n = k V
    exactly, hence tau = C_t n|n| = C V|V| with C_t = C / k^2 (thesis equations 4.14 and the servo of 4.13).
    """

    C: float
    """N/V^2, the true thrust constant."""
    rate_per_volt: float = 1.0
    """k, (rev/s)/V."""
    drag: float = 0.25
    """alpha, 1/rev: time constant 1 / (2 alpha |n| + stiffness), 0.08 s at 20 rev/s and 0.2 s at 4 rev/s."""
    stiffness: float = 3.0
    """1/s: how hard the driven motor pulls to k V (back-EMF). 0: textbook n' = beta V|V| - alpha n|n|."""
    friction: float = 1.5
    """1/s: bearing friction of the released rotor; from 20 rev/s it is below 0.5 rev/s after 1.6 s."""
    torque_acceleration: float = 7.2
    """(rev/s^2)/A: 20 A at 24 V with the figures above."""
    heating: float = 0.1
    """K/A^2: winding temperature rise per squared current: 40 K at 20 A."""
    heating_time: float = 120.0
    """s."""
    rotor: str = "servo"
    """"servo": the equation above. "instant": n = k V at once while driven, so tau = C V|V| at every instant;
    `drag` and `torque_acceleration` then only say the current, drag n|n| / torque_acceleration."""

    def __post_init__(self) -> None:
        if self.rotor not in ("servo", "instant"):
            raise ValueError(f"rotor must be one of servo, instant, got {self.rotor!r}")
        if not (self.rate_per_volt > 0 and self.drag > 0 and self.torque_acceleration > 0 and self.heating_time > 0):
            raise ValueError("rate_per_volt, drag, torque_acceleration and heating_time must be positive")


@dataclass(frozen=True, slots=True)
class Tunnel:
    """`[tunnel]`"""

    flow_speed: float = 0.0
    """m/s, positive when the water comes at the thruster from ahead."""
    water_temperature: float = 18.0
    """degC, at the start."""
    temperature_drift: float = 0.0
    """K/s, of the water."""
    pressure: float = 1.04e5
    """Pa, absolute, at the transmitter."""


@dataclass(frozen=True, slots=True)
class Supply:
    """`[supply]`"""

    voltage: float = 48.0
    """V, nominal; the drive's duty is a fraction of it."""


@dataclass(frozen=True, slots=True)
class Cell:
    """`[cell]`: the load-cell chain before its electronics."""

    gain_error: float = 0.0
    """relative: the cell reads (1 + gain_error) of the force."""
    zero_offset: float = 0.0
    """N, read with no load."""
    hysteresis: float = 0.0
    """N, half the width of the loop from nothing to `hysteresis_reach` and back, in its middle."""
    hysteresis_reach: float = 300.0
    """N."""
    gain_temperature: float = 0.0
    """1/K, relative: of the gain, with the water, in which the cell hangs."""
    zero_temperature: float = 0.0
    """N/K."""
    reference_temperature: float = 18.0
    """degC, at which neither is there."""

    def __post_init__(self) -> None:
        if self.hysteresis < 0 or not self.hysteresis_reach > 0:
            raise ValueError("hysteresis must be at least 0 N and hysteresis_reach above 0 N")


@dataclass(frozen=True, slots=True)
class WorldSettings:
    """One world. The mounted thruster can be changed while the rotor is at rest."""

    thrusters: Mapping[str, Thruster]
    mounted: str
    tunnel: Tunnel = field(default_factory=Tunnel)
    supply: Supply = field(default_factory=Supply)
    cell: Cell = field(default_factory=Cell)
    noise: Mapping[str, Noise] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """effect id -> its parameters; an effect that is not named is exactly absent."""


WORLD_TABLES = ("thrusters", "mounted", "tunnel", "supply", "cell", "noise", "effects")


def read_world(tables: Mapping[str, Any]) -> WorldSettings:
    """The world's tables of a world file. Raises WorldError; every effect is built once so that errors show now."""
    thrusters = {name: build(Thruster, t, f"thrusters.{name}") for name, t in tables.get("thrusters", {}).items()}
    if not thrusters:
        raise WorldError("thrusters: expected at least one table [thrusters.<name>], got none")
    mounted = tables.get("mounted", next(iter(thrusters)))
    check_known(mounted, thrusters, "mounted")
    noise = tables.get("noise", {})
    for channel in noise:
        check_known(channel, CHANNELS, "noise")
    effects = tables.get("effects", {})
    make_effects(effects)
    return WorldSettings(
        thrusters=thrusters,
        mounted=mounted,
        tunnel=build(Tunnel, tables.get("tunnel", {}), "tunnel"),
        supply=build(Supply, tables.get("supply", {}), "supply"),
        cell=build(Cell, tables.get("cell", {}), "cell"),
        noise={name: build(Noise, t, f"noise.{name}") for name, t in noise.items()},
        effects=effects,
    )


def make_effects(tables: Mapping[str, Mapping[str, Any]]) -> list[Effect]:
    """Fresh effects, in the order of the catalogue, from `[effects.<id>]` tables."""
    known = {**EFFECTS, **UNCATALOGUED}
    for name in tables:
        check_known(name, known, "effects")
    return [build(cls, tables[name], f"effects.{name}") for name, cls in known.items() if name in tables]
