"""The newest earlier recording of a thruster that says what power it takes, among those of a campaign's folder."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rig.dry_run.power import PowerCurve, measured_power
from rig.errors import RecordingError
from rig.hdf5 import load

LARGEST: Final = 200_000_000
"""Bytes of a recording that is read for this; a larger one takes longer than anybody waits for a dry run."""
LOOKED_AT: Final = 5
"""Newest recordings of a thruster that are tried."""


def known_power(output: Path, thruster: str) -> PowerCurve | str:
    """From the recordings `<output>/<campaign>/<thruster>[-2].h5`, newest first; else why it is not known."""
    try:
        candidates = _newest(output, thruster)
    except OSError as error:
        return f"not known: {output} can't be read: {error.strerror}"
    if not candidates:
        return f"not known: no earlier recording of {thruster} in the output folder"
    reasons = []
    for path in candidates[:LOOKED_AT]:
        found = _power_in(path, thruster)
        if isinstance(found, PowerCurve):
            return found
        reasons.append(found)
    return f"not known: {reasons[0]}"


def _newest(output: Path, thruster: str) -> list[Path]:
    if not output.is_dir():
        return []
    found = [path for path in output.glob("*/*.h5") if _is_of(path, thruster)]
    return sorted(found, key=lambda path: path.stat().st_mtime, reverse=True)


def _is_of(path: Path, thruster: str) -> bool:
    """By its name, with the number of a run that went on; the file's own word is looked at when it is read."""
    again = path.stem.removeprefix(f"{thruster}-")
    return (path.stem == thruster or (again != path.stem and again.isdigit())) and path.is_file()


def _power_in(path: Path, thruster: str) -> PowerCurve | str:
    name = f"{path.parent.name}/{path.name}"
    if path.stat().st_size > LARGEST:
        return f"{name} is larger than {LARGEST // 1_000_000} MB and is not read for this"
    try:
        recording = load(path)
    except RecordingError as error:
        return str(error)
    if recording.thruster != thruster:
        return f"{name} is a recording of {recording.thruster or 'no named thruster'}"
    found = measured_power(recording)
    return found if isinstance(found, str) else PowerCurve(found.volts, found.watts, name)
