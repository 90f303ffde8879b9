"""Vehicle recordings made ready for `rig vehicle`: loaded, given short names, refused with a reason."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path
from typing import TypeVar

import numpy as np

from identification.recording import Recording
from identification.vehicle.efficiency import AXES, Installation
from identification.vehicle.trials import dominant_axis, response_of
from identification.velocity.constant_velocity import LEAST_SAMPLES
from rig.errors import RecordingError
from rig.hdf5 import load
from rig.recording.recover import rather_recovered

T = TypeVar("T")
MOTION = ("position", "depth", "heading", "speed")


@dataclass(frozen=True, eq=False)
class Named:
    """A recording under the name of its file; `recording` has that name as its id, so that sentences can be read."""

    name: str
    path: Path
    uuid: str
    recording: Recording


def load_named(paths: Iterable[Path], taken: Sequence[Named] = ()) -> tuple[Named, ...]:
    """Load files; a folder stands for every `*.h5` in it. `taken` were given already. Raises RecordingError."""
    out: list[Named] = []
    for path in _expanded(paths):
        recording = load(path)
        for other in (*taken, *out):
            if other.uuid == recording.recording_id:
                raise RecordingError(f"{path} is the same recording as {other.path} ({other.uuid}); give it once")
        if recording.kind != "vehicle":
            raise RecordingError(
                f"{path} is a {recording.kind} recording, not one of a vehicle; thrusters come in by --thrusters, as "
                "`rig fit` writes them"
            )
        name = name_of(path, {other.name for other in (*taken, *out)})
        out.append(Named(name, path, recording.recording_id, replace(recording, recording_id=name, source=path.name)))
    return tuple(out)


def name_of(path: Path, taken: Container[str]) -> str:
    """By which trials are told apart: the file's, of a second one of that name with its folder."""
    return path.stem if path.stem not in taken else f"{path.parent.name}/{path.stem}"


def _expanded(paths: Iterable[Path]) -> list[Path]:
    files: list[Path] = []
    for path in paths:
        found = sorted(path.glob("*.h5")) if path.is_dir() else [path]
        if not found:
            raise RecordingError(f"{path} is a folder without recordings; expected *.h5 files in it")
        files += found
    return rather_recovered(files)


def check(named: Named, installation: Installation, axis: str = "") -> tuple[str, ...]:
    """Notes on what is missing. Raises RecordingError when the recording cannot be used for `axis` (or its own)."""
    _check_commands(named, installation)
    recording = named.recording
    wanted = axis or dominant_axis(recording, installation) or ""
    if not wanted:
        raise RecordingError(
            f"{named.path}: every command that drives the vehicle is 0 V throughout or pushes along no axis; leave the "
            "recording out, or state its axis and thrusters in the installation file"
        )
    channel = response_of(recording, wanted)
    if channel is None:
        there = sorted({f"{c.quantity} ({c.axis or 'no axis'})" for c in recording.channels if c.quantity in MOTION})
        raise RecordingError(
            f"{named.path} drives {wanted} but has no position, depth, heading or speed of that axis; it has "
            f"{', '.join(there) or 'no motion at all'}"
        )
    missing = int(np.count_nonzero(~np.isfinite(channel.value)))
    left = channel.value.size - missing
    if left < LEAST_SAMPLES:
        raise RecordingError(
            f"{named.path}: {missing} of {channel.value.size} values of {channel.name} are missing; at least "
            f"{LEAST_SAMPLES} are needed"
        )
    return (f"{named.name}: {missing} of {channel.value.size} values of {channel.name} are missing",) if missing else ()


def _check_commands(named: Named, installation: Installation) -> None:
    """Every command must be known at all times, and belong to a thruster of the installation."""
    known = {thruster.name for thruster in installation.thrusters}
    commands = named.recording.all_of("command_voltage")
    if not commands:
        raise RecordingError(f"{named.path} has no command_voltage; the force on the vehicle cannot be known")
    for channel in commands:
        if not np.all(np.isfinite(channel.value)):
            lost = float(channel.time[int(np.argmin(np.isfinite(channel.value)))])
            raise RecordingError(
                f"{named.path}: {channel.name} is missing from {lost:g} s on: the force is not known there; record it "
                "again or import without that stretch"
            )
        if channel.thruster is None and channel.axis in AXES:
            continue
        if channel.thruster not in known and np.any(channel.value != 0):
            who = f"thruster {channel.thruster!r}" if channel.thruster else f"no thruster ({channel.name})"
            raise RecordingError(
                f"{named.path} commands {who}, which the installation does not have; it has {', '.join(sorted(known))}"
            )


def matched(names: Iterable[str], patterns: Mapping[str, T]) -> dict[str, T]:
    """What a table keyed by file names, `*` and `?` allowed, says of each name; the last pattern that fits wins.

    >>> matched(["heave-1", "surge"], {"heave-*": "a", "heave-1": "b"})
    {'heave-1': 'b'}
    """
    return {name: facts for name in names for pattern, facts in patterns.items() if fnmatch(name, pattern)}
