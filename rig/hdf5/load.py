"""Reading a recording, whoever wrote it: the optional may be missing, the unknown is ignored, the odd is said."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np
from numpy.typing import NDArray

from identification.recording import QUANTITY_UNITS, Acquisition, Channel, Event, Recording, Step
from rig.errors import RecordingError
from rig.hdf5.apart import apart, open_no_more
from rig.hdf5.layout import text_of
from rig.hdf5.members import DAMAGE, LARGEST_VALUE, attributes, measured, member, members, numeric_columns, table
from rig.hdf5.opening import number, open_for_reading, require_file
from rig.hdf5.voided import without_voided

UNIT_SPELLINGS: Final = {"Nm": "N.m", "N m": "N.m", "N·m": "N.m", "°C": "degC", "m/s2": "m/s^2", "m/s²": "m/s^2"}
"""Spellings of the format's units that other programs use."""
NAMED: Final = ("recording_id", "thruster", "kind", "created", "complete", "outcome", "water_density")


@dataclass
class Findings:
    """What the reader has to say about a file; becomes warnings among its events."""

    texts: list[str] = field(default_factory=list)


def load(path: str | Path, rows: int | None = None) -> Recording:
    """A recording as read-only arrays; of every stream only the first `rows`, if given. Raises RecordingError.

    `attributes` has the root attributes that have no field of their own, `opened_as` (`plain`, or `swmr`: it was not
    closed in order, or is still being written) and `streams` (source, device and note of each). What was not as it
    should be (rows of different lengths, unknown units) is added to `events` as warnings.
    """
    path = Path(path)
    require_file(path)
    return apart(lambda: _load(path, rows), path)


def _load(path: Path, rows: int | None) -> Recording:
    file, opened_as = open_for_reading(path)
    open_no_more()
    try:
        with file:
            return _recording(file, path, opened_as, rows)
    except MemoryError:  # `apart` says what that means
        raise
    except DAMAGE as error:
        raise RecordingError(f"{path} is damaged: {error}") from error


def recording_id_of(path: Path) -> str:
    """The id alone; empty where the file has none. Raises RecordingError."""
    return identity_of(path)[0]


def identity_of(path: Path) -> tuple[str, str]:
    """The id alone, and `plain` or `swmr` (see `load`). Raises RecordingError."""
    require_file(path)
    return apart(lambda: _identity_of(path), path)


def _identity_of(path: Path) -> tuple[str, str]:
    file, opened_as = open_for_reading(path)
    open_no_more()
    with file:
        return text_of(file.attrs.get("recording_id", "")), opened_as


def _recording(file: h5py.File, path: Path, opened_as: str, rows: int | None) -> Recording:
    findings = Findings()
    if opened_as == "swmr":
        findings.texts.append(
            "not closed in order, or still being written: opened as it stands; `rig recover` copies it"
        )
    streams = {name: group for name, group in members(file["streams"]) if isinstance(group, h5py.Group)}
    channels = tuple(channel for name, group in streams.items() for channel in _channels(name, group, rows, findings))
    if not channels:
        raise RecordingError(f"{path} says it is a recording, but no stream in it has a time and a channel")
    steps = _steps(file, findings)
    events = _events(file, findings)
    root = {name: _plain(value) for name, value in attributes(file, findings.texts).items()}
    latest = max((float(channel.time[-1]) for channel in channels if channel.time.size), default=0.0)
    warnings = [Event(latest, "warning", text) for text in findings.texts]
    recording = Recording(
        recording_id=str(root.get("recording_id", "")),
        thruster=str(root.get("thruster", "")),
        channels=channels,
        steps=steps,
        events=(*events, *warnings),
        kind=str(root.get("kind", "tunnel")),
        created=str(root.get("created", "")),
        water_density=number(root.get("water_density")),
        source=path.name,
        attributes=_rest(root) | {"opened_as": opened_as, "streams": {n: _facts(g) for n, g in streams.items()}},
        **_end(file, root),
    )
    return without_voided(recording)


def _end(file: h5py.File, root: Mapping[str, object]) -> dict[str, Any]:
    """`complete`, `outcome` and `cause`: /end is believed before the root attributes."""
    end = member(file, "end")

    def fact(name: str, absent: object) -> Any:
        found = table(end, name) if isinstance(end, h5py.Group) else None
        return found[()] if found is not None and found.size == 1 else root.get(name, absent)

    return {
        "complete": bool(number(fact("complete", False))),
        "outcome": text_of(fact("outcome", "")),
        "cause": text_of(fact("cause", "")),
    }


def _rest(root: Mapping[str, object]) -> dict[str, object]:
    return {name: value for name, value in root.items() if name not in NAMED}


def _facts(group: h5py.Group) -> dict[str, str]:
    return {name: text_of(group.attrs.get(name, "")) for name in ("source", "device_id", "note")}


def _channels(stream: str, group: h5py.Group, rows: int | None, findings: Findings) -> list[Channel]:
    columns = numeric_columns(group)
    if "time" not in columns:
        findings.texts.append(f"stream {stream} has no numeric `time`: left out")
        return []
    ignored = sorted(set(group) - set(columns))
    if ignored:
        findings.texts.append(
            f"stream {stream}: {', '.join(ignored)} left out: no one-dimensional numbers that can be read"
        )
    lengths = {name: len(item) for name, item in columns.items()}
    n = min(lengths.values())
    if max(lengths.values()) > n:
        longest = max(lengths.values())
        findings.texts.append(f"stream {stream}: cut to its shortest dataset, {n} rows; {longest - n} were unfinished")
    n = n if rows is None else min(n, rows)
    try:
        time = columns.pop("time")[:n].astype(np.float64)
    except DAMAGE as error:
        findings.texts.append(f"stream {stream}: left out, for its times can't be read: {error}")
        return []
    good = _rising(time)
    if not good.all():
        findings.texts.append(
            f"stream {stream}: {np.count_nonzero(~good)} rows left out: time not finite or running back"
        )
    found = []
    for name, item in columns.items():
        try:
            found.append(_channel(stream, item, time, good, findings))
        except DAMAGE as error:
            findings.texts.append(f"{stream}/{name}: left out, for it can't be read: {error}")
    return found


def _rising(time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """True for rows whose time can be one and is not before any earlier row."""
    finite = np.abs(time) <= LARGEST_VALUE
    return finite & (time >= np.maximum.accumulate(np.where(finite, time, -np.inf)))


def _channel(
    stream: str, item: h5py.Dataset, time: NDArray[np.float64], good: NDArray[np.bool_], findings: Findings
) -> Channel:
    name, facts = item.name.rsplit("/", 1)[-1], item.attrs
    value, damaged = measured(item[: len(time)], facts.get("missing_value"))
    if damaged:
        findings.texts.append(f"{stream}/{name}: {damaged} values beyond {LARGEST_VALUE:g} are damaged: left out")
    quantity, unit = _quantity(f"{stream}/{name}", facts, findings)
    return Channel(
        name=name,
        stream=stream,
        quantity=quantity,
        unit=unit,
        time=time[good],
        value=value[good],
        noise_std=number(facts.get("noise_std")),
        range_min=number(facts.get("range_min")),
        range_max=number(facts.get("range_max")),
        calibration=_calibration(text_of(facts.get("calibration", ""))),
        thruster=text_of(facts.get("thruster", "")) or None,
        axis=text_of(facts.get("axis", "")) or None,
        description=text_of(facts.get("description", "")),
        acquisition=_acquisition(facts, item.parent.attrs),
    )


def _acquisition(channel: Mapping[str, Any], stream: Mapping[str, Any]) -> Acquisition:
    """What is said of it; a time or a step that is negative or not finite says nothing."""
    said = {key: number(channel.get(key)) for key in ("delay", "delay_std", "window", "low_pass", "quantum", "hold")}
    said |= {key: number(stream.get(key)) for key in ("period", "clock_drift_std")}
    said["period"] = said["period"] or None  # a clock that does not tick is none
    said["quantum"] = said["quantum"] or number(channel.get("resolution"))  # as it was called at first
    known = {key: value for key, value in said.items() if value is not None and np.isfinite(value) and value >= 0}
    how, rounding = (text_of(channel.get(key, "")) for key in ("filter", "rounding"))
    return Acquisition(**known, filter=how, rounding=rounding)


def _quantity(channel: str, facts: Mapping[str, Any], findings: Findings) -> tuple[str | None, str]:
    """Quantity and unit; a quantity in a unit that is not the format's is not used, for its numbers would be wrong."""
    quantity = text_of(facts.get("quantity", "")) or None
    unit = text_of(facts.get("unit", ""))
    unit = UNIT_SPELLINGS.get(unit, unit)
    known = QUANTITY_UNITS.get(quantity or "")
    if known is None:
        return quantity, unit
    if not unit:
        return quantity, known[0]
    if unit not in known:
        findings.texts.append(f"{channel}: {quantity} in {unit!r} is kept, not used; the format's unit is {known[0]}")
        return None, unit
    return quantity, unit


def _calibration(text: str) -> dict[str, object]:
    if not text:
        return {}
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        return {"text": text}
    return content if isinstance(content, dict) else {"value": content}


def _steps(file: h5py.File, findings: Findings) -> tuple[Step, ...]:
    rows = _table(file, "steps", ("index", "phase", "command_voltage", "t_start", "t_end"), findings)
    return tuple(Step(int(i), text_of(p), float(v), float(start), float(end)) for i, p, v, start, end in rows)


def _events(file: h5py.File, findings: Findings) -> tuple[Event, ...]:
    rows = _table(file, "events", ("time", "level", "text"), findings)
    return tuple(Event(float(time), text_of(level), text_of(text)) for time, level, text in rows)


def _table(file: h5py.File, name: str, fields: tuple[str, ...], findings: Findings) -> list[tuple[Any, ...]]:
    item = table(file, name)
    if item is None:
        if name in file:
            findings.texts.append(f"/{name} can't be read: left out")
        return []
    if not set(fields) <= set(item.dtype.names or ()):
        findings.texts.append(f"/{name} is not a table with the fields {', '.join(fields)}: left out")
        return []
    try:
        rows = np.atleast_1d(item[()])
    except DAMAGE as error:
        findings.texts.append(f"/{name} can't be read: left out: {error}")
        return []
    return list(zip(*(rows[field].tolist() for field in fields), strict=True))


def _plain(value: Any) -> Any:
    """An attribute as str, bool, int, float or list; what HDF5 has beside these as a text that says what it is."""
    if isinstance(value, bytes) or (isinstance(value, np.ndarray) and value.dtype.kind in "SO" and value.size == 1):
        return text_of(value)
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | bool | int | float) else text_of(value)
