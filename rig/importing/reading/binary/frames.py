"""Frames of a binary log, and the one table of rows that they make."""

from __future__ import annotations

import tempfile
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import repeat
from math import isnan, nan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.errors import RecordingError
from rig.importing.reading.table import Table

Floats = NDArray[np.float64]
TIME = "time"
"""Column of the log's own time in s, where it has one."""
MOST_ELEMENTS = 256
"""Of an array in a message: a longer one is a picture or a scan, no quantities of a thruster."""


class Columns(Mapping[str, Floats]):
    """Columns by name, each read when it is first asked for: a map asks for a few."""

    def __init__(self, names: Iterable[str], read: Callable[[str], Floats]) -> None:
        self._names, self._read = dict.fromkeys(names), read
        self._known: dict[str, Floats] = {}

    def __getitem__(self, name: str) -> Floats:
        if name not in self._known:
            if name not in self._names:
                raise KeyError(name)
            try:
                self._known[name] = self._read(name)
            except RecordingError:
                raise
            except Exception as error:  # whatever a library of somebody else raises for bytes it does not understand
                told = f"({type(error).__name__}: {error})"
                raise RecordingError(f"column {name} can't be read, it may be cut off or damaged {told}") from error
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


@dataclass(frozen=True, eq=False)
class Frame:
    """Columns that share their rows: a message, a topic, a group."""

    name: str
    columns: Mapping[str, Floats]
    """(n,) each; NaN where there is nothing."""
    time: Floats | None = None
    """(n,) s, on the log's clock; None: it has none but in its columns."""

    @property
    def rows(self) -> int:
        longest = self.time if self.time is not None else next(iter(self.columns.values()), np.zeros(0))
        return int(longest.size)


class Rows:
    """Rows of columns that are numbers, each as cells of text: read as a text's would be."""

    def __init__(self, columns: Mapping[str, Floats], count: int) -> None:
        self._columns, self._names, self._count = columns, tuple(columns), count

    def __len__(self) -> int:
        return self._count

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]:
        for i in range(self._count):
            yield i + 1, Row(self._columns, self._names, i)


class Row(Sequence[str]):
    """One of them; a cell is made when it is asked for."""

    def __init__(self, columns: Mapping[str, Floats], names: Sequence[str], place: int) -> None:
        self._columns, self._names, self._place = columns, names, place

    def __len__(self) -> int:
        return len(self._names)

    def __getitem__(self, at: Any) -> Any:
        if isinstance(at, slice):
            return [self[i] for i in range(*at.indices(len(self)))]
        value = float(self._columns[self._names[at]][self._place])
        return "" if isnan(value) else repr(value)


def table_of(frames: Sequence[Frame], what: str) -> Table:
    """One frame as it is; several in the order of their times, a row for each of theirs, named `frame.column`, empty
    where a row is of another. Raises RecordingError where there is nothing, and for several without times."""
    if not frames or not any(frame.columns for frame in frames):
        raise RecordingError(f"this {what} has no column of numbers in what the map asks for ([file] message)")
    if len(frames) == 1:
        (frame,) = frames
        own = frame.columns
        if frame.time is not None and TIME not in own:
            own = _with_time(frame.time, {name: partial(own.__getitem__, name) for name in own})
        return _table(own, frame.rows)
    untimed = [frame.name for frame in frames if frame.time is None]
    if untimed:
        raise RecordingError(f"{', '.join(untimed)}: without a time it can't be put among others; import it by itself")
    times = np.concatenate([frame.time for frame in frames if frame.time is not None])
    order = np.argsort(times, kind="stable")
    merged: dict[str, Callable[[], Floats]] = {}
    begins = 0
    for frame in frames:
        among = partial(_among, frame.columns, begins, order)
        merged |= {f"{frame.name}.{name}": partial(among, name) for name in frame.columns}
        begins += frame.rows
    return _table(_with_time(times[order], merged), times.size)


def _with_time(time: Floats, others: Mapping[str, Callable[[], Floats]]) -> Columns:
    made = {TIME: lambda: time, **others}
    return Columns(made, lambda name: made[name]())


def _among(columns: Mapping[str, Floats], begins: int, order: NDArray[np.intp], name: str) -> Floats:
    """Values of a frame whose rows begin there, with nothing in the rows of the others."""
    whole = np.full(order.size, np.nan)
    values = columns[name]
    whole[begins : begins + values.size] = values
    return whole[order]


def _table(columns: Mapping[str, Floats], count: int) -> Table:
    return Table(tuple(columns), Rows(columns, count), (), len(columns), "", latin=False)


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
    """Numbers of a message, by dotted names: fields of objects and mappings, `[i]` of short arrays from 0."""
    if isinstance(value, bool | int | float | np.number):
        yield name, float(value)
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from flat(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list | tuple | np.ndarray):
        if len(value) > MOST_ELEMENTS:
            return
        for i, inner in enumerate(value):
            yield from flat(inner, f"{name}[{i}]")
    elif hasattr(value, "__dataclass_fields__"):
        for key in value.__dataclass_fields__:
            yield from flat(getattr(value, key), f"{name}.{key}" if name else key)


class Gathered:
    """Messages one by one into frames; a field that a message has not is NaN there."""

    def __init__(self) -> None:
        self._times: dict[str, array[float]] = {}
        self._values: dict[str, dict[str, array[float]]] = {}

    def add(self, name: str, time: float, fields: Iterator[tuple[str, float]]) -> None:
        times = self._times.setdefault(name, array("d"))
        columns = self._values.setdefault(name, {})
        for field, value in fields:
            column = columns.setdefault(field, array("d"))
            column.extend(repeat(nan, len(times) - len(column)))
            column.append(value)
        times.append(time)

    def frames(self) -> list[Frame]:
        return [Frame(name, self._columns(name), np.array(times)) for name, times in self._times.items()]

    def _columns(self, name: str) -> dict[str, Floats]:
        rows, found = len(self._times[name]), {}
        for field, column in self._values[name].items():
            column.extend(repeat(nan, rows - len(column)))
            found[field] = np.array(column)
        return found


@contextmanager
def with_its_suffix(path: Path, suffix: str) -> Iterator[Path]:
    """The file by a name with that suffix, for a library that goes by it."""
    if path.suffix == suffix:
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        name = Path(folder, f"log{suffix}")
        name.symlink_to(path.resolve())
        yield name
