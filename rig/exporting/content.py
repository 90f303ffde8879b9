"""What an export is made of, whatever it is written as: one table per stream, steps, events, and a header."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from identification.recording import Channel, Recording
from rig.errors import ConfigError
from rig.hdf5 import load
from rig.hdf5.stream_rows import StreamRows

FORMAT = "thruster-rig-export"
FORMAT_VERSION = 1
HELD = "rows are changes: a value holds until the next row"


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table and what is known of it. `unit` is empty where there is none."""

    name: str
    unit: str
    facts: Mapping[str, Any]
    kind: Literal["number", "whole", "text"] = "number"

    @property
    def title(self) -> str:
        """Name and unit, for a table that has one line above its numbers."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


TIME = Column("time", "s", {"description": "since the start of the run, from a monotonic clock"})
STEP_COLUMNS = (
    Column("index", "", {"description": "of the step in its plan, from 0; below 0: no step of the plan"}, "whole"),
    Column("phase", "", {}, "text"),
    Column("command_voltage", "V", {}),
    Column("t_start", "s", {}),
    Column("t_end", "s", {}),
)
EVENT_COLUMNS = (TIME, Column("level", "", {}, "text"), Column("text", "", {}, "text"))


@dataclass(frozen=True, eq=False)
class Stream:
    """One device's table: its rows share one clock, and no other stream has it."""

    name: str
    columns: tuple[Column, ...]
    """Time first."""
    facts: Mapping[str, str]
    """Driver, model and serial number, note."""
    rows: StreamRows


@dataclass(frozen=True, eq=False)
class Content:
    """A recording to be written as something else."""

    header: Mapping[str, Any]
    """Thruster, outcome, campaign and bench files, and the facts of every channel: what JSON can hold."""
    streams: tuple[Stream, ...]
    steps: tuple[tuple[int, str, float, float, float], ...]
    """Rows of STEP_COLUMNS."""
    events: tuple[tuple[float, str, str], ...]
    """Rows of EVENT_COLUMNS."""


def content_of(path: Path, wanted: Collection[str] = ()) -> Content:
    """Everything of a recording but its rows; of the streams those `wanted`, or all. Raises RigError."""
    recording = load(path, rows=0)
    by_stream: dict[str, list[Channel]] = {}
    for channel in recording.channels:
        by_stream.setdefault(channel.stream, []).append(channel)
    for name in wanted:
        if name not in by_stream:
            raise ConfigError(f"--streams {name}: {path} has no such stream; it has {', '.join(by_stream)}")
    facts: Any = recording.attributes["streams"]
    streams = tuple(
        Stream(name, (TIME, *map(_column, channels)), _known(facts[name]), StreamRows(path, tuple(channels)))
        for name, channels in by_stream.items()
        if name in (wanted or by_stream)
    )
    steps = tuple((s.index, s.phase, s.command_voltage, s.t_start, s.t_end) for s in recording.steps)
    events = tuple((e.time, e.level, e.text) for e in recording.events)
    return Content(_header(recording, streams), streams, steps, events)


def _known(facts: Mapping[str, Any]) -> dict[str, Any]:
    """What is said at all, as JSON has it: no number that is none."""
    return {name: _finite(value) for name, value in facts.items() if value not in (None, "", {})}


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _column(channel: Channel) -> Column:
    """With every attribute of the format that the recording has for it."""
    plain = ("quantity", "noise_std", "range_min", "range_max", "calibration", "thruster", "axis", "description")
    facts = {name: getattr(channel, name) for name in plain} | asdict(channel.acquisition)
    if channel.quantity == "command_voltage":
        facts["rows"] = HELD
    return Column(channel.name, channel.unit, _known(facts))


def _header(recording: Recording, streams: tuple[Stream, ...]) -> dict[str, Any]:
    told = ("recording_id", "thruster", "kind", "created", "complete", "outcome", "cause", "water_density", "source")
    rest = {name: value for name, value in recording.attributes.items() if name not in ("streams", "format_version")}
    header = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "written_by": f"thruster-rig {_version()}, rig export",
    }
    known = _known({name: getattr(recording, name) for name in told} | rest)
    return header | {name: value for name, value in known.items() if name not in header} | {
        "streams": {
            stream.name: {
                **stream.facts,
                "columns": {column.name: {"unit": column.unit, **column.facts} for column in stream.columns},
            }
            for stream in streams
        }
    }  # fmt: skip


def _version() -> str:
    try:
        return version("thruster-rig")
    except PackageNotFoundError:
        return "(not installed)"
