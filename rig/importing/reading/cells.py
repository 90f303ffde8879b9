"""Cells of the columns that a map uses, as numbers. A row with one bad cell is left out whole, and counted."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isnan

import numpy as np

from identification.recording import Floats
from rig.importing.expression import names_in
from rig.importing.mapping import ChannelMap, Column, ImportMap, Time
from rig.importing.reading.row_filter import columns_of, parse, refuse_empty, row_passes
from rig.importing.reading.table import Refused, Table, index_of, no_such_column
from rig.importing.timing.clock import reader
from rig.importing.units import factor_to_si


@dataclass(frozen=True, eq=False)
class Cells:
    """Good rows only: `columns` by the name that expressions know, each (rows,); `time` of each clock in s."""

    columns: Mapping[str, Floats]
    time: Mapping[Time, Floats]
    rows: int
    filtered: int = 0
    """Rows that the map's filter did not want."""


def columns_used(plan: ImportMap, table: Table, parameters: Mapping[str, float]) -> dict[str, Column]:
    """Every column that a channel uses, by the name that expressions know it by. Raises RecordingError."""
    used: dict[str, Column] = {}
    for stream in plan.streams.values():
        for channel in stream.channels.values():
            for name in names_of(channel):
                if name not in parameters and name not in plan.header_values:
                    used[name] = plan.columns.get(name) or _direct(channel, name)
    missing = [column for column in used.values() if not column.optional and _place(table, column) is None]
    if missing:
        raise no_such_column(table, missing[0].any_of[0][0])
    return used


def names_of(channel: ChannelMap) -> tuple[str, ...]:
    """Names that a channel needs: those of its expression, or its one column."""
    return names_in(channel.value) if channel.value else (str(channel.column),)


def _direct(channel: ChannelMap, name: str) -> Column:
    """A column without an entry in [columns]: a header name, a number, or c1, c2 ... in an expression."""
    if channel.column is not None:
        return Column(((channel.column, 1.0),))
    number = name[1:] if name.startswith("c") and name[1:].isdigit() else ""
    return Column(((int(number) if number else name, 1.0),))


def _place(table: Table, column: Column) -> tuple[int, float] | None:
    for reference, factor in column.any_of:
        index = index_of(table, reference)
        if index is not None:
            return index, factor_to_si(factor) if isinstance(factor, str) else factor
    return None


def time_index(table: Table, clock: Time) -> int | None:
    """0-based column of a clock, None when it has none. Raises RecordingError when the file lacks it."""
    if clock.column is None:
        return None
    index = index_of(table, clock.column)
    if index is None:
        raise no_such_column(table, clock.column)
    return index


@dataclass(frozen=True)
class RowReader:
    """Reads the used cells of a row: times first, then numbers."""

    indices: Sequence[int]
    clocks: Sequence[tuple[int, Callable[[str], float]]]
    missing: frozenset[str]
    comma: bool

    def read(self, row: Sequence[str]) -> tuple[list[float], list[float]]:
        """Raises ValueError that says what is wrong with the row."""
        try:
            times = [read(self._text(row[index])) for index, read in self.clocks]
        except ValueError as error:
            raise ValueError("the time is not as the map says") from error
        try:
            values = [self._number(row[index]) for index in self.indices]
        except ValueError as error:
            raise ValueError("a cell is not a number") from error
        if not np.isfinite(times).all() or np.inf in np.abs(values):
            raise ValueError("a cell is not a finite number")
        return times, values

    def _text(self, cell: str) -> str:
        return cell.strip().replace(",", ".") if self.comma else cell.strip()

    def _number(self, cell: str) -> float:
        """NaN only where the map says that such a cell means nothing was measured."""
        text = self._text(cell)
        if text in self.missing:
            return float("nan")
        number = float(text)
        if isnan(number):
            raise ValueError(text)
        return number


def read_cells(plan: ImportMap, table: Table, columns: Mapping[str, Column], refused: Refused) -> Cells:
    """Numbers of all good rows; `refused` is told of the others."""
    places = {name: place for name, column in columns.items() if (place := _place(table, column)) is not None}
    indices = sorted({index for index, _ in places.values()})
    clocks = {clock: index for clock in _clocks(plan) if (index := time_index(table, clock)) is not None}
    row_reader = RowReader(
        indices,
        [(index, reader(clock)) for clock, index in clocks.items()],
        frozenset(plan.file.missing),
        plan.file.decimal == ",",
    )
    wanted = _Filtered()
    times, values = _good_rows(_wanted(plan, table, refused, wanted), row_reader, refused)
    if plan.file.where:
        refuse_empty(plan.file.where, wanted.kept, len(table.rows))
    by_index = {index: values[:, k] for k, index in enumerate(indices)}
    named = {name: _scaled(by_index[index], factor, columns[name]) for name, (index, factor) in places.items()}
    return Cells(named, {clock: times[:, k] for k, clock in enumerate(clocks)}, len(values), wanted.left_out)


@dataclass
class _Filtered:
    """What the map's filter did."""

    kept: int = 0
    left_out: int = 0


def _wanted(
    plan: ImportMap, table: Table, refused: Refused, filtered: _Filtered
) -> Iterator[tuple[int, Sequence[str]]]:
    """Rows that the map's filter lets through, one after another; `filtered` counts."""
    if not plan.file.where:
        yield from table.rows
        return
    wanted, comma = parse(plan.file.where), plan.file.decimal == ","
    places = {name: _filter_place(plan, table, name) for name in columns_of(wanted)}
    for line, row in table.rows:
        try:
            passes = row_passes(wanted, row, places, comma)
        except ValueError:
            refused.add("the filter compares a cell with a number that is none", line)
            continue
        filtered.kept += passes
        filtered.left_out += not passes
        if passes:
            yield line, row


def _filter_place(plan: ImportMap, table: Table, name: str) -> int:
    """0-based column that a filter means: an alias of [columns], a name of the header, or c1, c2 ... by number."""
    number = name[1:] if name.startswith("c") and name[1:].isdigit() else ""
    column = plan.columns.get(name) or Column(((name, 1.0), *(((int(number), 1.0),) if number else ())))
    place = _place(table, column)
    if place is None:
        raise no_such_column(table, name)
    return place[0]


def _good_rows(
    rows: Iterable[tuple[int, Sequence[str]]], row_reader: RowReader, refused: Refused
) -> tuple[Floats, Floats]:
    kept_times, kept_values, count = array("d"), array("d"), 0
    latest = [-np.inf] * len(row_reader.clocks)
    for line, row in rows:
        try:
            times, values = row_reader.read(row)
        except ValueError as error:
            refused.add(str(error), line)
            continue
        if any(now < before for now, before in zip(times, latest, strict=True)):
            refused.add("time runs backwards", line)
            continue
        latest = times
        kept_times.extend(times)
        kept_values.extend(values)
        count += 1
    time_grid = np.array(kept_times, dtype=np.float64).reshape(count, len(row_reader.clocks))
    value_grid = np.array(kept_values, dtype=np.float64).reshape(count, len(row_reader.indices))
    return time_grid, value_grid


def _scaled(raw: Floats, factor: float, column: Column) -> Floats:
    """Times its factor; the numbers at the start that mean "not measured yet" become NaN."""
    out = raw * factor
    if column.not_given is not None:
        given = raw != column.not_given
        out[: int(np.argmax(given)) if given.any() else len(raw)] = np.nan
    return out


def _clocks(plan: ImportMap) -> list[Time]:
    own = [stream.time for stream in plan.streams.values() if stream.time is not None]
    return list(dict.fromkeys([plan.time, *own]))
