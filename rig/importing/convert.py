"""A table and a map into streams of SI rows. What was assumed, changed or left out is said in events."""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from rig.errors import ConfigError, RecordingError
from rig.importing.cells import Cells, columns_used, names_of, read_cells, time_index
from rig.importing.clock import regular, wall_clock
from rig.importing.expression import evaluate
from rig.importing.mapping import ChannelMap, Column, ImportMap, StreamMap, Time
from rig.importing.table import Refused, Table, header_value, read_table
from rig.link.recorder_messages import ChannelSpec, StepRow, StreamSpec

MAX_BAD_SHARE = 0.5
"""A file with more bad rows than this is of another layout than the map says."""


@dataclass(frozen=True, eq=False)
class StreamData:
    spec: StreamSpec
    time: Floats
    """(n,) s since the first row of the file."""
    values: Floats
    """(n, channels)."""


@dataclass(frozen=True, eq=False)
class Imported:
    """A recording about to be written."""

    streams: tuple[StreamData, ...]
    steps: tuple[StepRow, ...]
    notes: tuple[str, ...]
    """Assumptions, parameters."""
    warnings: tuple[str, ...]
    """What was left out, per reason."""
    created: str
    """ISO 8601 UTC of the first row, where the file says it with a time zone."""
    rows: int
    bad: int


def convert(data: bytes, plan: ImportMap, overrides: Mapping[str, float]) -> Imported:
    """Bytes of a file into streams. Raises ConfigError for the map, RecordingError for the file."""
    parameters = _parameters(plan, overrides)
    refused = Refused()
    table = read_table(data, plan.file, refused)
    total = len(table.rows) + refused.counts.total()
    columns = columns_used(plan, table, parameters)
    cells = read_cells(plan, table, columns, refused)
    _check_share(refused, total)
    parameters |= {name: header_value(table, name, wanted) for name, wanted in plan.header_values.items()}
    scope: dict[str, Floats | float] = {**parameters, **cells.columns}
    found = [_stream(name, stream, plan, cells, scope) for name, stream in plan.streams.items()]
    streams = tuple(stream for stream in found if stream is not None)
    if not streams:
        raise RecordingError("none of the map's channels is in the file; is this the right map?")
    created, clock_note = _created(plan.time, table)
    encoding = [f"the file is not {plan.file.encoding}; read as {table.encoding}"] if table.latin else []
    return Imported(
        streams=streams,
        steps=_steps(plan, streams),
        notes=(
            *plan.notes,
            *_parameter_notes(parameters),
            *clock_note,
            *_absent(columns, cells),
            *_begun(columns, cells),
        ),
        warnings=(*encoding, *refused.sentences()),
        created=created,
        rows=cells.rows,
        bad=refused.counts.total(),
    )


def _check_share(refused: Refused, total: int) -> None:
    bad = refused.counts.total()
    if total == 0:
        raise RecordingError("there is no row of data in the file")
    if bad > MAX_BAD_SHARE * total:
        why = "; ".join(refused.sentences())
        raise RecordingError(f"{bad} of {total} rows are bad, so the file has not the layout of the map: {why}")


def _parameter_notes(parameters: Mapping[str, float]) -> list[str]:
    return [f"{name} = {value:.12g}" for name, value in parameters.items()]


def _absent(columns: Mapping[str, Column], cells: Cells) -> list[str]:
    names = [name for name in columns if name not in cells.columns]
    return [f"the file has no column for {', '.join(names)}: channels that need it are left out"] if names else []


def _begun(columns: Mapping[str, Column], cells: Cells) -> list[str]:
    """How many rows at the start were taken as "not measured yet"."""
    counts = {name: _leading_nan(cells.columns[name]) for name in cells.columns if columns[name].not_given is not None}
    return [
        f"{name}: the first {n} rows are exactly {columns[name].not_given:g}: taken as not measured yet"
        for name, n in counts.items()
        if n
    ]


def _leading_nan(values: Floats) -> int:
    given = np.isfinite(values)
    return int(np.argmax(given)) if given.any() else len(values)


def _parameters(plan: ImportMap, overrides: Mapping[str, float]) -> dict[str, float]:
    for name in overrides:
        if name not in plan.parameters:
            near = difflib.get_close_matches(name, plan.parameters, 1)
            hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(plan.parameters) or 'none'}"
            raise ConfigError(f"the map has no parameter {name}; {hint}")
    return {**plan.parameters, **overrides}


def _stream(
    name: str, stream: StreamMap, plan: ImportMap, cells: Cells, scope: Mapping[str, Floats | float]
) -> StreamData | None:
    present = {
        channel: facts for channel, facts in stream.channels.items() if all(used in scope for used in names_of(facts))
    }
    if not present:
        return None
    clock = stream.time or plan.time
    time = cells.time[clock] if clock in cells.time else regular(clock, cells.rows, command=stream.changes)
    start = cells.time[plan.time] if plan.time in cells.time else np.zeros(1)
    values = np.column_stack([_channel(facts, scope, cells.rows) for facts in present.values()])
    keep = _changes(values) if stream.changes else ~np.all(np.isnan(values), axis=1)
    specs = tuple(_spec(channel, facts) for channel, facts in present.items())
    spec = StreamSpec(name, stream.source, specs, stream.device_id, stream.note)
    return StreamData(spec, time[keep] - (start[0] if start.size else 0.0), values[keep])


def _channel(facts: ChannelMap, scope: Mapping[str, Floats | float], n: int) -> Floats:
    raw = evaluate(facts.value, scope) if facts.value else np.asarray(scope[str(facts.column)], dtype=np.float64)
    out = np.broadcast_to(facts.sign * (facts.factor * raw + facts.offset), (n,)).astype(np.float64)
    if facts.unwrap:
        given = np.isfinite(out)
        out[given] = np.unwrap(out[given])
    return out


def _changes(values: Floats) -> NDArray[np.bool_]:
    """The first row, and each that differs from the row before it."""
    keep = np.ones(len(values), dtype=np.bool_)
    same = (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    keep[1:] = ~same.all(axis=1)
    return keep


def _spec(name: str, facts: ChannelMap) -> ChannelSpec:
    source = facts.value or f"{facts.sign} * ({facts.factor!r} * column {facts.column!r} + {facts.offset!r})"
    return ChannelSpec(
        name=name,
        quantity=facts.quantity,
        unit=facts.unit,
        integer=facts.integer,
        noise_std=facts.noise_std,
        range_min=facts.range_min,
        range_max=facts.range_max,
        calibration=json.dumps({"imported_as": source, **facts.calibration}, ensure_ascii=False),
        thruster=facts.thruster,
        axis=facts.axis,
        description=facts.description,
    )


def _created(clock: Time, table: Table) -> tuple[str, list[str]]:
    index = time_index(table, clock)
    for _, row in table.rows if index is not None and clock.format else ():
        try:
            text, known = wall_clock(clock, row[index or 0])
        except ValueError:
            continue
        return (text, []) if known else ("", [f"the file's first time is {text}, without a time zone"])
    return "", []


def _steps(plan: ImportMap, streams: tuple[StreamData, ...]) -> tuple[StepRow, ...]:
    """Holds of a table of levels, one per row that the command's stream kept, up to the next."""
    length = plan.time.level_duration
    commands = [
        (data, index)
        for data in streams
        for index, channel in enumerate(data.spec.channels)
        if channel.quantity == "command_voltage"
    ]
    if length is None or not commands:
        return ()
    data, index = commands[0]
    end = max(float(stream.time[-1]) for stream in streams if stream.time.size) + length / 2
    ends = [*data.time[1:].tolist(), end]
    rows = zip(data.time.tolist(), ends, data.values[:, index].tolist(), strict=True)
    return tuple(StepRow(i, "hold", volts, start, stop) for i, (start, stop, volts) in enumerate(rows))
