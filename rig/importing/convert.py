"""A table and a map into streams of SI rows. What was assumed, changed or left out is said in events."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from identification.recording import Floats
from rig.errors import ConfigError, RecordingError
from rig.importing.channels import channels_of
from rig.importing.mapping import Column, ImportMap
from rig.importing.reading.binary.kinds import read_binary
from rig.importing.reading.cells import Cells, columns_used, read_cells
from rig.importing.reading.table import Refused, header_value, read_table
from rig.importing.streams import StreamData, laid_out
from rig.importing.understood import doubts, first_time, understood
from rig.importing.units import KNOWN_PARAMETERS
from rig.link.recorder_messages import StepRow

MAX_BAD_SHARE = 0.5
"""A file with more bad rows than this is of another layout than the map says."""


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
    clock_start: float | None = None
    """s on the file's own clock where the recording's time is 0; None where the file has no time."""


def convert(content: bytes | Path, plan: ImportMap, overrides: Mapping[str, float]) -> Imported:
    """The bytes of a text, or the place of another file, into streams. Raises ConfigError for the map, RecordingError
    for the file."""
    parameters = _parameters(plan, overrides)
    refused = Refused()
    if isinstance(content, bytes):
        table = read_table(content, plan.file, refused)
    else:
        table = read_binary(content, plan.file.kind, plan.file.message)
        plan = replace(plan, file=replace(plan.file, missing=(*plan.file.missing, "")))
    total = len(table.rows) + refused.counts.total()
    columns = columns_used(plan, table, parameters)
    cells = read_cells(plan, table, columns, refused)
    _check_share(refused, total)
    parameters |= {name: header_value(table, name, wanted) for name, wanted in plan.header_values.items()}
    channels = channels_of(plan, cells, parameters)
    if not channels:
        raise RecordingError("none of the map's channels is in the file; is this the right map?")
    found = laid_out(plan, cells, channels)
    created, clock_note = first_time(plan.time, table)
    line = understood(plan, found.rows, cells, channels)
    encoding = [f"the file is not {plan.file.encoding}; read as {table.encoding}"] if table.latin else []
    return Imported(
        streams=found.streams,
        steps=found.steps,
        notes=(line, *plan.notes, *_parameter_notes(parameters), *clock_note, *_remarks(columns, cells, plan)),
        warnings=(*encoding, *refused.sentences(), *doubts(channels)),
        created=created,
        rows=cells.rows,
        bad=refused.counts.total(),
        clock_start=found.start,
    )


def _remarks(columns: Mapping[str, Column], cells: Cells, plan: ImportMap) -> list[str]:
    filtered = [f"{cells.filtered} rows left out by the filter: {plan.file.where}"] if plan.file.where else []
    return [*filtered, *_absent(columns, cells), *_begun(columns, cells)]


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
    known = parameters_known(plan)
    for name in overrides:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known) or 'none'}"
            raise ConfigError(f"the map has no parameter {name}; {hint}")
    return {**plan.parameters, **overrides}


def parameters_known(plan: ImportMap) -> list[str]:
    """Those of the map, and those that units may ask for: of a command that is no voltage, of electrical speed."""
    driven = {"command_voltage", "rotation_rate"}
    found = [c for stream in plan.streams.values() for c in stream.channels.values() if c.quantity in driven]
    return [*plan.parameters, *(name for name in KNOWN_PARAMETERS if found and name not in plan.parameters)]
