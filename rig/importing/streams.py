"""Channels into streams with times: a log's rows as they are, a level table's command where its level begins."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from rig.importing.channels import ChannelData
from rig.importing.mapping import ImportMap, StreamMap
from rig.importing.reading.cells import Cells
from rig.importing.timing.clock import regular
from rig.importing.timing.levels import LevelTimes, Rows, level_times, rows_are
from rig.link.recorder_messages import ChannelSpec, StepRow, StreamSpec

COMMAND = "command_voltage"


@dataclass(frozen=True, eq=False)
class StreamData:
    """The n rows of one stream, as a recording will hold them."""

    spec: StreamSpec
    time: Floats
    """(n,) s since the first row of the file; of a table of levels since the first level began."""
    values: Floats
    """(n, channels)."""


@dataclass(frozen=True, eq=False)
class LaidOut:
    """Streams and steps of a recording, and what the rows were taken for."""

    streams: tuple[StreamData, ...]
    steps: tuple[StepRow, ...]
    rows: Rows
    start: float | None
    """s on the file's own clock of the recording's time 0; None where the file has no time."""


def laid_out(plan: ImportMap, cells: Cells, channels: Sequence[ChannelData]) -> LaidOut:
    """Raises RecordingError where the rows do not tell whether they are levels."""
    commands = [c for c in channels if c.facts.quantity == COMMAND and plan.streams[c.stream].time in (None, plan.time)]
    time = cells.time[plan.time] if plan.time in cells.time else regular(plan.time, cells.rows)
    first = commands[0].values if commands else None
    rows = rows_are(plan.time, time, first, vehicle=plan.kind == "vehicle")
    levels = level_times(plan.time, time) if rows.levels and time.size else None
    start = float((time if levels is None else levels.start)[0]) if time.size else 0.0
    streams: list[StreamData] = []
    for name, stream in plan.streams.items():
        own = [c for c in channels if c.stream == name]
        for called, part in _apart(name, own) if levels is not None else [(name, own)]:
            if part:
                time = _time(plan, stream, cells, levels, part) - start
                streams.append(
                    _stream(called, stream, part, time, levels, apart=plan.file.kind != "text" and levels is None)
                )
    steps = () if levels is None else _steps(levels, first, start)
    return LaidOut(tuple(streams), steps, rows, start if plan.time in cells.time else None)


def _apart(name: str, own: Sequence[ChannelData]) -> list[tuple[str, list[ChannelData]]]:
    """A level's command and what was measured on it have different times: two streams where the map has one."""
    commands = [c for c in own if c.facts.quantity == COMMAND]
    others = [c for c in own if c.facts.quantity != COMMAND]
    return [(f"{name}_command" if others else name, commands), (name, others)]


def _time(
    plan: ImportMap, stream: StreamMap, cells: Cells, levels: LevelTimes | None, part: Sequence[ChannelData]
) -> Floats:
    """S on the file's clock, (rows,)."""
    clock = stream.time or plan.time
    if levels is not None and clock == plan.time:
        return levels.start if part[0].facts.quantity == COMMAND else levels.middle
    return cells.time[clock] if clock in cells.time else regular(clock, cells.rows)


def _stream(
    name: str,
    stream: StreamMap,
    part: Sequence[ChannelData],
    time: Floats,
    levels: LevelTimes | None,
    *,
    apart: bool,
) -> StreamData:
    """A level without a command stays: nobody knows what was commanded there, and it was not the level before.

    `apart`: rows may be of several messages of a log, and those of others are no rows of this stream."""
    values = np.column_stack([channel.values for channel in part])
    known = ~np.all(np.isnan(values), axis=1)
    if apart:
        time, values = time[known], values[known]
        known = np.ones(len(values), np.bool_)
    if levels is not None and part[0].facts.quantity == COMMAND:
        known[:] = True
    keep = changed_rows(values) if stream.changes else known
    spec = StreamSpec(name, stream.source, tuple(_spec(channel) for channel in part), stream.device_id, stream.note)
    return StreamData(spec, time[keep], values[keep])


def changed_rows(values: Floats) -> NDArray[np.bool_]:
    """(n,) of values (n, k): the first row, and each that differs from the row before it."""
    keep = np.ones(len(values), dtype=np.bool_)
    same = (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    keep[1:] = ~same.all(axis=1)
    return keep


def _spec(channel: ChannelData) -> ChannelSpec:
    facts = channel.facts
    source = f"{channel.sign:g} * ({facts.factor!r} * column {facts.column!r} + {facts.offset!r})"
    if facts.value:
        source = facts.value if channel.sign > 0 else f"-({facts.value})"
    if channel.conversion is not None and channel.conversion.said:
        source += f", {channel.conversion.name} -> {channel.conversion.si}: {channel.conversion.said}"
    return ChannelSpec(
        name=channel.name,
        quantity=facts.quantity,
        unit=channel.unit,
        integer=facts.integer,
        noise_std=facts.noise_std,
        delay=facts.low_pass if facts.delay is None else facts.delay,
        delay_std=facts.delay_std,
        window=facts.window,
        low_pass=facts.low_pass,
        filter=facts.filter,
        range_min=facts.range_min,
        range_max=facts.range_max,
        calibration=json.dumps({"imported_as": source, **facts.calibration}, ensure_ascii=False),
        thruster=facts.thruster,
        axis=facts.axis,
        description=facts.description,
    )


def _steps(levels: LevelTimes, command: Floats | None, start: float) -> tuple[StepRow, ...]:
    """A hold for each level; neighbours with the same command are one, rows without a command are none."""
    if command is None:
        return ()
    begins = np.flatnonzero(changed_rows(command[:, None]))
    ends = np.append(levels.start[begins[1:]], levels.end[-1:])
    rows = zip(levels.start[begins].tolist(), ends.tolist(), command[begins].tolist(), strict=True)
    held = [(a, b, volts) for a, b, volts in rows if np.isfinite(volts)]
    return tuple(StepRow(i, "hold", volts, a - start, b - start) for i, (a, b, volts) in enumerate(held))
