"""What `rig fit --json` found of the thrusters, with its covariance, put where the installation file says they sit."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from identification.recording import Floats, Recording
from identification.steady_state.points import voltage_channel
from identification.vehicle.efficiency import AXES, Installation, Thruster
from rig.errors import ConfigError, RecordingError
from rig.hdf5 import load
from rig.vehicle.installation import InstallationFile, Mounting

FORMAT = "thruster-rig-fit"
VERSION = 1
USABLE = {"C V|V|": ("C",), "C+/C-": ("C_plus", "C_minus")}
"""Models that a command voltage alone turns into a force, and their coefficients."""


@dataclass(frozen=True, slots=True)
class Coefficient:
    """N/V^2."""

    value: float
    std_statistical: float
    std_calibration: float
    """Of the load cell's gain, shared by every thruster of one file."""


@dataclass(frozen=True)
class Calibration:
    """One thruster of one file."""

    thruster: str
    model: str
    coefficients: tuple[Coefficient, ...]
    statistical: Floats
    """(p, p): scatter of the fit; C_plus and C_minus have one tare."""
    source: str


def read_fits(paths: Sequence[Path]) -> dict[str, Calibration]:
    """Thruster -> its calibration, of one or more files of `rig fit --json`. Raises ConfigError."""
    found: dict[str, Calibration] = {}
    for path in paths:
        for entry in _document(path):
            one = _calibration(path, entry)
            if one.thruster in found:
                raise ConfigError(
                    f"{path}: thruster {one.thruster} is in {found[one.thruster].source} too; give one fit of each"
                )
            found[one.thruster] = one
    return found


def _document(path: Path) -> list[dict[str, Any]]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(f"{path}: there is no such file; make one with `rig fit RECORDINGS --json {path}`") from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise ConfigError(f"{path}: not JSON of `rig fit --json`: {error}") from None
    said = content.get("format") if isinstance(content, dict) else None
    if said != FORMAT:
        raise ConfigError(f"{path}: format is {said!r}, expected {FORMAT!r}: a file of `rig fit --json`")
    if content.get("version") != VERSION:
        raise ConfigError(f"{path}: version {content.get('version')!r} of {FORMAT}; this program reads {VERSION}")
    fits = content.get("fits")
    if not isinstance(fits, list) or not fits:
        raise ConfigError(f"{path}: holds no fit")
    return fits


def _calibration(path: Path, entry: Any) -> Calibration:
    """The model asked for if a voltage suffices for it, else an alternative that does."""
    try:
        name = str(entry["thruster"])
        models = [entry, *entry.get("alternatives", ())]
        chosen = next((one for one in models if one["model"] in USABLE and one.get("voltage") != "rotation_rate"), None)
        if chosen is None:
            told = ", ".join(str(one["model"]) for one in models)
            raise ConfigError(
                f"{path}: thruster {name} is fitted as {told}; vehicle trials know the command voltage: fit it with "
                "`rig fit --model C` or `--model C+/C-` against a voltage"
            )
        wanted = USABLE[chosen["model"]]
        coefficients = tuple(_coefficient(path, name, key, chosen["parameters"][key]) for key in wanted)
        return Calibration(name, chosen["model"], coefficients, _statistical(chosen, wanted, coefficients), path.name)
    except (KeyError, TypeError, AttributeError) as error:
        raise ConfigError(f"{path}: an entry of fits is not as `rig fit --json` writes it: {error!r}") from None


def _statistical(chosen: Mapping[str, Any], wanted: Sequence[str], coefficients: Sequence[Coefficient]) -> Floats:
    """(p, p); a file written before fits had a covariance says nothing of what lies beside the diagonal."""
    told = chosen.get("covariance") or {}
    if told.get("statistical") is None:
        return _independent(coefficients)
    at = [told["names"].index(name) for name in wanted]
    return np.array(told["statistical"], dtype=np.float64)[np.ix_(at, at)]


def _independent(coefficients: Sequence[Coefficient]) -> Floats:
    return np.diag([c.std_statistical**2 for c in coefficients])


def _coefficient(path: Path, thruster: str, name: str, entry: Mapping[str, Any]) -> Coefficient:
    value, std = entry["value"], entry["std"]
    if value is None or std is None:
        raise ConfigError(
            f"{path}: {name} of thruster {thruster} is not determined; measure it at two voltages or more"
        )
    calibration = entry.get("std_calibration") or 0.0
    statistical = entry.get("std_statistical")
    if statistical is None:
        statistical = max(std**2 - calibration**2, 0.0) ** 0.5
    return Coefficient(float(value), float(statistical), float(calibration))


def installed(file: InstallationFile, fits: Mapping[str, Calibration]) -> Installation:
    """Thrusters as they sit on the vehicle. Raises ConfigError when one has no model."""
    parts = [_placed(file, name, mounting, fits) for name, mounting in file.thrusters.items()]
    thrusters = tuple(part.thruster for part in parts)
    coefficients = [c for part in parts for c in part.coefficients]
    scatter = block_diag(*(part.statistical for part in parts))
    return Installation(thrusters, covariance(coefficients, scatter), file.interactions)


def covariance(coefficients: Sequence[Coefficient], statistical: Floats) -> Floats:
    """(p, p): scatter of the fits, and the gain of the cell that all of them share."""
    common = np.array([c.std_calibration * np.sign(c.value) for c in coefficients])
    out: Floats = statistical + np.outer(common, common)
    return out


@dataclass(frozen=True)
class _Placed:
    """A thruster on the vehicle, and what is known of its thrust."""

    thruster: Thruster
    coefficients: tuple[Coefficient, ...]
    statistical: Floats


def _placed(file: InstallationFile, name: str, mounting: Mounting, fits: Mapping[str, Calibration]) -> _Placed:
    if mounting.curve or mounting.table:
        levels, thrust = (
            _curve(file.path.parent / mounting.curve, file.path)
            if mounting.curve
            else np.array(mounting.table, dtype=np.float64).T
        )
        found = tuple(Coefficient(float(value), 0.0, 0.0) for value in thrust)
        return _Placed(Thruster(name, thrust, mounting.arms, levels), found, _independent(found))
    if mounting.C is not None:
        stated: tuple[Coefficient, ...] = (Coefficient(mounting.C, mounting.C_std, 0.0),)
        scatter = _independent(stated)
    else:
        wanted = mounting.fit or name
        if wanted not in fits:
            there = ", ".join(fits) or "nothing"
            asked = "the fits hold" if fits else "--thrusters was not given and the file states no C or curve: there is"
            raise ConfigError(f"{file.path}: thruster {name} needs a fit of {wanted!r}; {asked} {there}")
        stated, scatter = fits[wanted].coefficients, fits[wanted].statistical
    return _Placed(Thruster(name, np.array([c.value for c in stated]), mounting.arms), stated, scatter)


def _curve(path: Path, asked_by: Path) -> tuple[Floats, Floats]:
    """Levels (n,) V ascending and the mean thrust (n,) N at each."""
    try:
        recording = load(path)
    except RecordingError as error:
        raise ConfigError(f"{asked_by}: curve: {error}") from error
    thrust, voltage = recording.first_of("thrust"), voltage_channel(recording)
    if thrust is None or voltage is None:
        raise ConfigError(f"{asked_by}: curve {path} has no thrust or no voltage; give a tunnel or bollard recording")
    V = voltage.held_at(thrust.time)
    good = np.isfinite(V) & np.isfinite(thrust.value)
    levels, where = np.unique(V[good], return_inverse=True)
    if levels.size < 2:
        raise ConfigError(f"{asked_by}: curve {path} has {levels.size} level(s); at least two are needed")
    return levels, np.bincount(where, thrust.value[good]) / np.bincount(where)


def straight_ahead(recordings: Iterable[Recording]) -> dict[str, Mounting]:
    """Thrusters of recordings that come without an installation file, each pushing straight along the measured axis.

    The axis is that of the command channel, else the only one whose motion the recording has.
    """
    axes: dict[str, dict[str, float]] = {}
    for recording in recordings:
        moving = {c.axis for c in recording.channels if c.quantity in {"position", "speed"}} - {None}
        moving |= {"heave" for c in recording.channels if c.quantity == "depth"}
        only = next(iter(moving)) if len(moving) == 1 else None
        for channel in recording.all_of("command_voltage"):
            axis = channel.axis or only
            if channel.thruster is not None and axis is not None and np.any(np.nan_to_num(channel.value) != 0):
                axes.setdefault(channel.thruster, {})[axis] = 1.0
    return {name: _pushing(arms) for name, arms in axes.items()}


def _pushing(arms: Mapping[str, float]) -> Mounting:
    surge, sway, heave, yaw = (arms.get(axis, 0.0) for axis in AXES)
    return Mounting(surge, sway, heave, yaw)
