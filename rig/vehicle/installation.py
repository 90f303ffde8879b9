"""The installation file of a vehicle: which thruster sits where, whose jet meets what, what each trial was.

TOML, as bench and campaign files: an unknown key is an error that names the nearest known one. No number of a
thruster is in it unless it is stated here for want of a fit. docs/howto/vehicle.md explains every key.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeVar

from identification.vehicle.efficiency import AXES, Interaction
from rig.errors import ConfigError
from rig.toml_tables import Table, decode, joined, read_toml, refuse_unknown, table_at

T = TypeVar("T")

KNOWABLE = ("m", "k", "k2", "current_north", "current_east")
"""Parameters, besides efficiencies, that `[known.<axis>]` may state."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """`[vehicle]`."""

    name: str = ""
    current: bool = True
    """Allow for a uniform current in surge and sway; false for a tank."""


@dataclass(frozen=True, slots=True)
class Mounting:
    """`[thrusters.<name>]`: N (yaw: N.m) on the vehicle per N of thrust; where its model comes from."""

    surge: float = 0.0
    sway: float = 0.0
    heave: float = 0.0
    yaw: float = 0.0
    """m: the lever."""
    fit: str = ""
    """Its name in the file of `rig fit`; empty: the same."""
    C: float | None = None
    """N/V^2, stated here instead of fitted."""
    C_std: float = 0.0
    curve: str = ""
    """Path, relative to this file, of a tunnel or bollard recording: thrust at each level, straight lines between.

    For thrusters that are no C V|V|.
    """

    table: tuple[tuple[float, float], ...] = ()
    """The same written down: [[V, N], ...], V ascending."""

    def __post_init__(self) -> None:
        if sum((self.C is not None, bool(self.curve), bool(self.table), bool(self.fit))) > 1:
            raise ValueError("takes one of fit, C, curve and table")
        levels = [V for V, _ in self.table]
        if self.table and (len(levels) < 2 or sorted(set(levels)) != levels):
            raise ValueError("table needs two or more pairs [V, N], V ascending")
        if not self.arms:
            raise ValueError("pushes along no axis; give surge, sway, heave or yaw a number other than 0")
        if not all(map(math.isfinite, self.arms.values())) or not 0 <= self.C_std < math.inf:
            raise ValueError("numbers must be finite and C_std not negative")

    @property
    def arms(self) -> dict[str, float]:
        """Axis -> arm, of those that are not 0."""
        arms = {"surge": self.surge, "sway": self.sway, "heave": self.heave, "yaw": self.yaw}
        return {axis: arm for axis, arm in arms.items() if arm != 0}


@dataclass(frozen=True, slots=True)
class Efficiency:
    """`[efficiencies.<name>]`: one installation coefficient and when it applies to which thrusters."""

    forward: tuple[str, ...] = ()
    """Thrusters at positive voltage: their jet meets the hull."""
    backward: tuple[str, ...] = ()
    """Thrusters at negative voltage."""
    always: tuple[str, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()
    """Both of a pair while both turn: propeller and propeller."""

    def interactions(self, name: str) -> tuple[Interaction, ...]:
        groups = ((self.forward, 1), (self.backward, -1), (self.always, 0))
        found = [Interaction(name, group, direction) for group, direction in groups if group]
        partner = {a: b for pair in self.pairs for a, b in (pair, pair[::-1])}
        if partner:
            found.append(Interaction(name, tuple(partner), 0, partner))
        return tuple(found)

    @property
    def named(self) -> tuple[str, ...]:
        return (*self.forward, *self.backward, *self.always, *(name for pair in self.pairs for name in pair))


@dataclass(frozen=True, slots=True)
class TrialFacts:
    """`[trials."<file name, * and ? allowed>"]`: what the commands do not say."""

    ballast: str = ""
    """Heave: files of the same ballast share one buoyancy."""
    axis: Literal["", "surge", "sway", "heave", "yaw"] = ""
    step: Literal["", "steady", "moving"] = ""
    """`steady`: constant-velocity runs (step one); `moving`: a sine or any other motion (step two)."""


@dataclass(frozen=True, slots=True)
class Known:
    """`[known.<axis>.<parameter>]`: a value from elsewhere and its standard deviation."""

    value: float
    std: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.value) and 0 < self.std < math.inf):
            raise ValueError("value must be a number and std a number above 0")


@dataclass(frozen=True)
class InstallationFile:
    """All of an installation file."""

    path: Path
    text: str
    vehicle: Vehicle
    thrusters: Mapping[str, Mounting]
    efficiencies: Mapping[str, Efficiency] = field(default_factory=dict)
    trials: Mapping[str, TrialFacts] = field(default_factory=dict)
    known: Mapping[str, Mapping[str, Known]] = field(default_factory=dict)

    @property
    def interactions(self) -> tuple[Interaction, ...]:
        return tuple(one for name, found in self.efficiencies.items() for one in found.interactions(name))


def load_installation(path: Path) -> InstallationFile:
    """Read an installation file. Raises ConfigError with one sentence."""
    text, content = read_toml(path, "installation file")
    refuse_unknown(path, "", content, ("vehicle", "thrusters", "efficiencies", "trials", "known"))
    mounted = table_at(path, content, "thrusters")
    if not mounted:
        raise ConfigError(f"{path}: [thrusters] is empty; give each thruster a table [thrusters.<name>]")
    efficiencies = _tables(Efficiency, path, content, "efficiencies")
    _check_efficiencies(path, efficiencies, mounted)
    return InstallationFile(
        path=path,
        text=text,
        vehicle=decode(Vehicle, table_at(path, content, "vehicle", optional=True), path, "vehicle"),
        thrusters=_tables(Mounting, path, content, "thrusters"),
        efficiencies=efficiencies,
        trials=_tables(TrialFacts, path, content, "trials"),
        known=_known(path, content, tuple(efficiencies)),
    )


def _tables(cls: type[T], path: Path, content: Table, key: str) -> dict[str, T]:
    found = table_at(path, content, key, optional=True)
    return {name: decode(cls, table_at(path, found, name, key), path, joined(key, name)) for name in found}


def _check_efficiencies(path: Path, found: Mapping[str, Efficiency], mounted: Table) -> None:
    for name, efficiency in found.items():
        where = joined("efficiencies", name)
        if name in KNOWABLE:
            raise ConfigError(f"{path}: {where} has the name of a parameter; call it eta_{name}")
        if not efficiency.named:
            raise ConfigError(f"{path}: {where} names no thruster; give forward, backward, always or pairs")
        refuse_unknown(path, where, efficiency.named, mounted)
        inside = [thruster for pair in efficiency.pairs for thruster in pair]
        twice = next((thruster for thruster in inside if inside.count(thruster) > 1), None)
        if twice is not None:
            raise ConfigError(f"{path}: {where}.pairs names {twice} twice; a thruster has one partner")


def _known(path: Path, content: Table, etas: tuple[str, ...]) -> dict[str, dict[str, Known]]:
    axes = table_at(path, content, "known", optional=True)
    refuse_unknown(path, "known", axes, AXES)
    out = {}
    for axis in axes:
        stated = table_at(path, axes, axis, "known")
        refuse_unknown(path, joined("known", axis), stated, (*KNOWABLE, *etas))
        out[axis] = {
            name: decode(Known, table_at(path, stated, name, f"known.{axis}"), path, f"known.{axis}.{name}")
            for name in stated
        }
    return out
