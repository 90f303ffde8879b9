"""One line that says how an import understood time, command and units, and what in the data speaks against it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from rig.errors import ConfigError
from rig.importing.channels import ChannelData
from rig.importing.mapping import ImportMap, Time
from rig.importing.reading.cells import Cells, time_index
from rig.importing.reading.table import Table
from rig.importing.streams import COMMAND
from rig.importing.timing.clock import wall_clock
from rig.importing.timing.levels import Rows
from rig.importing.units import FROM_HEADER, conversion, unit_in

AGAINST: Final = -0.5
"""Correlation of thrust and command below which thrust is taken to have the other sign."""


def understood(plan: ImportMap, rows: Rows, cells: Cells, channels: Sequence[ChannelData]) -> str:
    """For example: understood: time 't' in ms, 600 rows over 59.9 s, a log (...); command ...; units ..."""
    parts = [f"time {_time(plan.time, cells)}, {_rows(plan.time, rows)}", _command(plan, channels), _units(channels)]
    return f"understood: {'; '.join(part for part in parts if part)}"


def _time(clock: Time, cells: Cells) -> str:
    if clock.level_duration is not None:
        return f"none in the file, {cells.rows} rows of {clock.level_duration:g} s each"
    if clock.rate is not None:
        return f"none in the file, {cells.rows} rows at {clock.rate:g} Hz"
    time = cells.time[clock]
    unit = "as date and time" if clock.format else f"in {clock.unit}"
    column = f"column {clock.column}" if isinstance(clock.column, int) else repr(clock.column)
    span = float(time[-1] - time[0]) if time.size else 0.0
    return f"{column} {unit}, {cells.rows} rows over {span:.4g} s"


def _rows(clock: Time, rows: Rows) -> str:
    if not rows.levels:
        return f"a log ({rows.because})"
    place = "the time is the level's " + clock.level_time if clock.level_duration is None else "one after the other"
    return f"a table of levels ({rows.because}): {place}, command at a level's start, measured values in its middle"


def _command(plan: ImportMap, channels: Sequence[ChannelData]) -> str:
    commands = [c for c in channels if c.facts.quantity == COMMAND]
    if not commands:
        return "no command"
    return "command " + ", ".join(_one_command(c, plan) for c in commands)


def _one_command(channel: ChannelData, plan: ImportMap) -> str:
    by = f"{channel.source}{_arithmetic(channel)}"
    finite = channel.values[np.isfinite(channel.values)]
    held = ", each held until it changes" if plan.streams[channel.stream].changes else ""
    return f"{by}: {finite.min():.4g} to {finite.max():.4g} V{held}" if finite.size else f"{by}: no number"


def _units(channels: Sequence[ChannelData]) -> str:
    told = [c for c in channels if c.facts.quantity not in (None, COMMAND)]
    return "units " + ", ".join(f"{c.facts.quantity} {_unit(c)}" for c in told) if told else ""


def _unit(channel: ChannelData) -> str:
    return f"{channel.unit}{_arithmetic(channel)}{' with its sign turned' if channel.sign < 0 else ''}"


def _arithmetic(channel: ChannelData) -> str:
    change = channel.conversion
    if change is None or not change.said:
        return ""
    return f" (from {change.name}: {change.said})"


def doubts(channels: Sequence[ChannelData]) -> Iterator[str]:
    """Sentences about what does not fit together: units of the header, a thrust that goes against its command."""
    for channel in channels:
        yield from _other_unit(channel)
    yield from _wrong_way(channels)


def _other_unit(channel: ChannelData) -> Iterator[str]:
    facts, quantity = channel.facts, channel.facts.quantity
    plain = isinstance(facts.column, str) and facts.factor == 1 and facts.offset == 0 and facts.unit != FROM_HEADER
    unit = unit_in(str(facts.column)) if plain and quantity is not None else ""
    if not unit or quantity is None or channel.conversion is None:
        return
    said = conversion(quantity, unit) if _is_known(quantity, unit) else None
    if said is not None and (said.si, said.said) != (channel.conversion.si, channel.conversion.said):
        yield (
            f"{channel.stream}/{channel.name}: the file's header says {unit}, the map {facts.unit}: so it was read; "
            f'if the header is right, write unit = "{unit}" (or "header") in the map'
        )


def _is_known(quantity: str, unit: str) -> bool:
    try:
        conversion(quantity, unit)
    except ConfigError:
        return False
    return True


def _wrong_way(channels: Sequence[ChannelData]) -> Iterator[str]:
    command = next((c for c in channels if c.facts.quantity == COMMAND), None)
    thrust = next((c for c in channels if c.facts.quantity == "thrust"), None)
    if command is None or thrust is None:
        return
    good = np.isfinite(command.values) & np.isfinite(thrust.values)
    x, y = command.values[good], thrust.values[good]
    if x.size < 3 or not np.ptp(x) or not np.ptp(y):
        return
    together = float(np.corrcoef(x, y)[0, 1])
    if together < AGAINST:
        named, other = thrust.facts.sign, -int(thrust.sign)
        do = f"--set {named}={other}" if isinstance(named, str) else f"sign = {other} in the map"
        yield (
            f"thrust goes against the command (correlation {together:.2f}): the cell's sign is the other way round, or "
            f"the motor's leads; where it is the cell: {do}"
        )


def first_time(clock: Time, table: Table) -> tuple[str, list[str]]:
    """ISO text of the first row's time where its zone is known; else what the file says, as a sentence."""
    index = time_index(table, clock)
    for _, row in table.rows if index is not None and clock.format else ():
        try:
            text, known = wall_clock(clock, row[index or 0])
        except ValueError:
            continue
        return (text, []) if known else ("", [f"the file's first time is {text}, without a time zone"])
    return "", []
