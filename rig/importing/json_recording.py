"""A recording written as JSON by a program that writes no HDF5: the recording format word for word, no map needed.

    {"format": "thruster-rig-recording", "format_version": 1,
     "attributes": {"thruster": "T1", "kind": "vehicle"},
     "streams": {"gyro": {"source": "...", "time": [0.0, 0.1],
                          "channels": {"heading": {"quantity": "heading", "unit": "rad", "value": [0.0, null]}}}},
     "steps": [{"phase": "hold", "command_voltage": 8.0, "t_start": 0.0, "t_end": 60.0}]}

Times are s, ascending; null is a value that was not given.
"""

from __future__ import annotations

import codecs
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.recording import QUANTITY_UNITS, Floats
from rig.errors import RecordingError
from rig.importing.convert import Imported
from rig.importing.reading.without_map import HEAD, what_to_do
from rig.importing.streams import StreamData
from rig.link.recorder_messages import Attribute, ChannelSpec, StepRow, StreamSpec

FORMAT = "thruster-rig-recording"
VERSION = 1
MOST_BYTES = 64 * 2**20
"""JSON takes some ten times its size while it is read."""
KINDS = ("tunnel", "bollard", "vehicle")
FACTS = ("noise_std", "range_min", "range_max", "thruster", "axis", "description")
"""Attributes of a channel that are taken over; `calibration` is an object."""


@dataclass(frozen=True, eq=False)
class Plain:
    """What such a file holds."""

    attributes: dict[str, Attribute]
    imported: Imported


def read_plain(data: bytes) -> Plain:
    """Raises RecordingError with one sentence that says where the file is not as the format asks."""
    if not data[:HEAD].lstrip(codecs.BOM_UTF8 + b" \t\r\n").startswith((b"{", b"[")):
        raise RecordingError(f"no JSON, and a table needs --map: {what_to_do(data)}")
    if len(data) > MOST_BYTES:
        raise RecordingError(f"{len(data)} bytes of JSON; at most {MOST_BYTES} are read: write a table, and a map")
    try:
        content = json.loads(data)
    except RecursionError:
        raise RecordingError("JSON that is nested too deeply to be a recording") from None
    except ValueError as error:
        raise RecordingError(f"not JSON: {error}; a table needs --map") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise RecordingError(f'JSON without "format": "{FORMAT}"; a table needs --map')
    if content.get("format_version") != VERSION:
        raise RecordingError(f"format_version {content.get('format_version')!r}; this program reads {VERSION}")
    try:
        attributes = _attributes(content.get("attributes", {}))
        streams = tuple(_stream(name, found) for name, found in content["streams"].items())
        steps = tuple(_step(i, step) for i, step in enumerate(content.get("steps", ())))
    except (KeyError, TypeError, AttributeError, ValueError, OverflowError) as error:
        raise RecordingError(f"the JSON is not as rig/importing/json_recording.py shows: {error!r}") from None
    rows = sum(stream.time.size for stream in streams)
    notes = ("read from JSON in the words of the recording format", _understood(streams, steps))
    return Plain(attributes, Imported(streams, steps, notes, (), "", rows, 0))


def _understood(streams: Sequence[StreamData], steps: Sequence[StepRow]) -> str:
    """Nothing of it is an assumption: the file itself says all."""
    ends = [(float(s.time[0]), float(s.time[-1])) for s in streams if s.time.size]
    span = f"{min(a for a, _ in ends):.4g} to {max(b for _, b in ends):.4g} s" if ends else "no rows"
    told = [c for s in streams for c in s.spec.channels if c.quantity is not None]
    command = [c.name for c in told if c.quantity == "command_voltage"]
    units = ", ".join(f"{c.quantity} {c.unit}" for c in told if c.quantity != "command_voltage")
    driven = f"command {', '.join(command)} in V, {len(steps)} steps" if command else "no command"
    return f"understood: time in s, {span}; {driven}; units {units or 'none'}"


def _attributes(found: Mapping[str, Any]) -> dict[str, Attribute]:
    wrong = [name for name, value in found.items() if not isinstance(value, str | bool | int | float)]
    if wrong:
        raise ValueError(f"attribute {wrong[0]} must be text, a number or true or false")
    if found.get("kind", "tunnel") not in KINDS:
        raise ValueError(f"kind {found['kind']!r}; known are {', '.join(KINDS)}")
    return dict(found)


def _stream(name: str, found: Mapping[str, Any]) -> StreamData:
    time = _numbers(found["time"])
    if time.size and not np.all(np.diff(time) >= 0):
        raise ValueError(f"stream {name}: time must be numbers that ascend")
    channels = [
        _channel(f"{name}/{channel}", channel, facts, time.size) for channel, facts in found["channels"].items()
    ]
    if not channels:
        raise ValueError(f"stream {name} has no channel")
    spec = StreamSpec(name, str(found.get("source", "")), tuple(spec for spec, _ in channels))
    return StreamData(spec, time, np.column_stack([values for _, values in channels]))


def _channel(who: str, name: str, facts: Mapping[str, Any], rows: int) -> tuple[ChannelSpec, Floats]:
    quantity, unit = facts.get("quantity"), str(facts["unit"])
    if quantity is not None and unit not in QUANTITY_UNITS.get(quantity, ()):
        known = " or ".join(QUANTITY_UNITS.get(quantity, ())) or f"one of {', '.join(QUANTITY_UNITS)} as the quantity"
        raise ValueError(f"channel {who}: {quantity} in {unit!r}, expected {known}")
    values = _numbers(facts["value"])
    if values.size != rows:
        raise ValueError(f"channel {who}: {values.size} values at {rows} times")
    calibration = json.dumps(facts["calibration"]) if "calibration" in facts else None
    more = {key: facts[key] for key in FACTS if facts.get(key) is not None}
    return ChannelSpec(name, quantity, unit, calibration=calibration, **more), values


def _numbers(values: Any) -> Floats:
    """What is null becomes NaN."""
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _step(index: int, found: Mapping[str, Any]) -> StepRow:
    numbers = (float(found[key]) for key in ("command_voltage", "t_start", "t_end"))
    return StepRow(index, str(found["phase"]), *numbers)
