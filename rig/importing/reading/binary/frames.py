"""Frames of a binary log, and the one table of rows that they make."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.errors import RecordingError
from rig.importing.reading.table import Table

Floats = NDArray[np.float64]
TIME = "time"
"""Column of the log's own time in s, where it has one."""


@dataclass(frozen=True, eq=False)
class Frame:
    """Columns that share their rows: a message, a topic, a group."""

    name: str
    columns: Mapping[str, Floats]
    """(n,) each; NaN where there is nothing."""
    time: Floats | None = None
    """(n,) s, on the log's clock; None: it has none but in its columns."""


class Rows:
    """Rows of columns that are numbers, each as cells of text: read as a text's would be."""

    def __init__(self, columns: Sequence[Floats], count: int) -> None:
        self._columns, self._count = columns, count

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]:
        for i in range(self._count):
            yield i + 1, Row(self._columns, i)


class Row(Sequence[str]):
    """One of them; a cell is made when it is asked for."""

    def __init__(self, columns: Sequence[Floats], place: int) -> None:
        self._columns, self._place = columns, place

    def __len__(self) -> int:
        return len(self._columns)

    def __getitem__(self, at: Any) -> Any:
        if isinstance(at, slice):
            return [self[i] for i in range(*at.indices(len(self)))]
        value = float(self._columns[at][self._place])
        return "" if isnan(value) else repr(value)


def table_of(frames: Sequence[Frame], what: str) -> Table:
    """One frame as it is; several in the order of their times, a row for each of theirs, named `frame.column`, empty
    where a row is of another. Raises RecordingError where there is nothing, and for several without times."""
    if not frames or not any(frame.columns for frame in frames):
        raise RecordingError(f"this {what} has no column of numbers in what the map asks for ([file] message)")
    if len(frames) == 1:
        (frame,) = frames
        own = dict(frame.columns)
        if frame.time is not None and TIME not in own:
            own = {TIME: frame.time, **own}
        return _table(own)
    untimed = [frame.name for frame in frames if frame.time is None]
    if untimed:
        raise RecordingError(f"{', '.join(untimed)}: without a time it can't be put among others; import it by itself")
    times = np.concatenate([frame.time for frame in frames if frame.time is not None])
    order = np.argsort(times, kind="stable")
    merged: dict[str, Floats] = {TIME: times[order]}
    begins = 0
    for frame in frames:
        for name, values in frame.columns.items():
            whole = np.full(times.size, np.nan)
            whole[begins : begins + values.size] = values
            merged[f"{frame.name}.{name}"] = whole[order]
        begins += 0 if frame.time is None else frame.time.size
    return _table(merged)


def _table(columns: Mapping[str, Floats]) -> Table:
    count = max((values.size for values in columns.values()), default=0)
    values = [np.asarray(each, np.float64) for each in columns.values()]
    return Table(tuple(columns), Rows(values, count), (), len(columns), "", latin=False)


def numeric(values: Any) -> Floats | None:
    """One column (n,) as numbers, times as s; None where it is something else."""
    array = np.asarray(values)
    if array.ndim != 1:
        return None
    if array.dtype.kind == "M":
        return np.asarray(array.astype("datetime64[ns]").astype(np.int64) * 1e-9, np.float64)
    if array.dtype.kind == "m":
        return np.asarray(array.astype("timedelta64[ns]").astype(np.int64) * 1e-9, np.float64)
    return np.asarray(array, np.float64) if array.dtype.kind in "biuf" else None


def flat(value: Any, name: str = "") -> Iterator[tuple[str, float]]:
    """Numbers of a message, by dotted names: fields of objects and mappings, `[i]` of arrays from 0."""
    if isinstance(value, bool | int | float | np.number):
        yield name, float(value)
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from flat(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list | tuple | np.ndarray):
        for i, inner in enumerate(value):
            yield from flat(inner, f"{name}[{i}]")
    elif hasattr(value, "__dataclass_fields__"):
        for key in value.__dataclass_fields__:
            yield from flat(getattr(value, key), f"{name}.{key}" if name else key)


class Gathered:
    """Messages one by one into frames; a field that a message has not is NaN there."""

    def __init__(self) -> None:
        self._times: dict[str, list[float]] = {}
        self._values: dict[str, dict[str, list[float]]] = {}

    def add(self, name: str, time: float, fields: Iterator[tuple[str, float]]) -> None:
        times = self._times.setdefault(name, [])
        columns = self._values.setdefault(name, {})
        for field, value in fields:
            column = columns.setdefault(field, [])
            column.extend([np.nan] * (len(times) - len(column)))
            column.append(value)
        times.append(time)

    def frames(self) -> list[Frame]:
        out = []
        for name, times in self._times.items():
            columns = {
                field: np.array(column + [np.nan] * (len(times) - len(column)))
                for field, column in self._values[name].items()
            }
            out.append(Frame(name, columns, np.array(times)))
        return out
