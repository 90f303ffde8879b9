"""The file of a simulated vehicle, `benches/romeo/vehicle.toml`: the truth that its trials have to find."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from sim_devices.tables import WorldError, build, check_known
from sim_devices.vehicle.body import AXES, Body, Hull
from sim_devices.vehicle.romeo import HORIZONTAL, VERTICAL, romeo

TABLES = ("thrusters", "axes", "noise")


@dataclass(frozen=True, slots=True)
class Scalars:
    """Keys at the top of the file."""

    seed: int = 1
    eta_hull: float = 0.7
    eta_pair: float = 0.85
    current_north: float = 0.0
    """m/s"""
    current_east: float = 0.0
    buoyancy: float = 0.0
    """N downwards."""
    wander: float = 0.0
    """N"""
    cell_gain_error: float = 0.0
    """Of the load cell in the tunnel: it reads (1 + this) of the thrust."""
    cell_gain_std: float = 0.005
    """Relative standard uncertainty that its certificate states."""


@dataclass(frozen=True, slots=True)
class Noise:
    """`[noise]`: standard deviations; those of Hull where absent."""

    position: float = 0.07
    depth: float = 0.005
    heading: float = 0.005


@dataclass(frozen=True, slots=True)
class VehicleSettings:
    """All of such a file."""

    scalars: Scalars
    hull: Hull


def load(path: Path) -> VehicleSettings:
    """Raises WorldError with one sentence."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise WorldError(f"{path}: {error}") from None
    try:
        return read(content)
    except ValueError as error:
        raise WorldError(f"{path}: {error}") from None


def read(content: Mapping[str, Any]) -> VehicleSettings:
    """Tables of a vehicle file; a thruster or axis that is not there is as in `romeo`."""
    known = [field.name for field in fields(Scalars)]
    for key in content:
        check_known(key, (*known, *TABLES), "vehicle file")
    scalars = build(Scalars, {key: content[key] for key in content if key not in TABLES}, "vehicle file")
    constants = content.get("thrusters", {})
    for name, C in constants.items():
        check_known(name, (*HORIZONTAL, *VERTICAL), "thrusters")
        if not isinstance(C, int | float) or not C > 0:
            raise WorldError(f"thrusters.{name}: expected C in N/V^2 above 0, got {C!r}")
    plain = romeo()
    axes = dict(plain.axes)
    for axis, table in content.get("axes", {}).items():
        check_known(axis, AXES, "axes")
        axes[axis] = build(Body, table, f"axes.{axis}")
    current = (scalars.current_north, scalars.current_east)
    hull = romeo(constants, axes, scalars.eta_hull, scalars.eta_pair, current, scalars.wander)
    noise = build(Noise, content.get("noise", {}), "noise")
    sigma = {"position": noise.position, "depth": noise.depth, "heading": noise.heading}
    return VehicleSettings(scalars, replace(hull, buoyancy=scalars.buoyancy, noise=sigma))
