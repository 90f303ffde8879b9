"""Import maps: TOML that says what the columns of a file are. An unknown key names the nearest known one."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from identification.recording import QUANTITY_UNITS
from rig.errors import ConfigError
from rig.importing.expression import names_in
from rig.importing.reading.row_filter import parse
from rig.importing.units import FROM_HEADER, conversion, factor_to_si, seconds
from rig.regular_file import read
from rig.toml_tables import MOST_BYTES, parsed

ColumnRef = str | int
"""Name in the header, or number counted from 1."""


@dataclass(frozen=True)
class Column:
    """A column with a name to use in expressions. `any_of`: the first that the header has, times its factor."""

    any_of: tuple[tuple[ColumnRef, float | str], ...]
    """The factor is a number, or the name of a unit that is only a factor: `["Thrust (gf)", "gf"]`."""
    optional: bool = False
    """Channels that need a column which is not there are left out."""
    not_given: float | None = None
    """Exactly this number at the start of the file means that nothing was measured yet: NaN."""


LONGEST_DELAY = 60.0
"""s of a converter, filter or mean: what is longer was meant in ms."""


@dataclass(frozen=True)
class HeaderValue:
    """A number from a line above the data: field `field` (from 1) of the line whose first field is `line`."""

    line: str
    field: int


@dataclass(frozen=True)
class Time:
    """Exactly one of `column`, `rate` and `level_duration`."""

    column: ColumnRef | None = None
    unit: str = "s"
    format: str = ""
    """`iso`, or a pattern of strptime; empty: a number in `unit`."""
    rate: float | None = None
    """Hz, when the file has no time."""
    level_duration: float | None = None
    """s: each row is a level held so long; its measured values stand in the middle of it."""
    levels: bool | None = None
    """Each row of a file with times is a level and what was measured on it; None: told by the rows, or asked."""
    level_time: Literal["start", "middle", "end"] = "middle"
    """What of a level the time of its row is."""


@dataclass(frozen=True)
class ChannelMap:
    """A channel: `sign * (factor * column + offset)`, or the expression `value`."""

    quantity: str | None = None
    unit: str = ""
    """Of what `column` or `value` gives; of a quantity any that rig.importing.units knows, or `header`."""
    column: ColumnRef | None = None
    value: str = ""
    factor: float = 1.0
    offset: float = 0.0
    sign: Literal[1, -1] | str = 1
    """1, -1, or the name of a parameter that is one of them."""
    unwrap: bool = False
    """Take jumps of more than pi out of an angle in rad."""
    integer: bool = False
    noise_std: float | None = None
    range_min: float | None = None
    range_max: float | None = None
    delay: float | None = None
    """s from the quantity to its stamp, the group delay of `low_pass` in it; not given, it is that."""
    delay_std: float | None = None
    """s."""
    window: float | None = None
    """s that a value is the mean over."""
    low_pass: float | None = None
    """s, time constant of an amplifier or filter of first order before that."""
    filter: str = ""
    """In words."""
    thruster: str = ""
    axis: str = ""
    description: str = ""
    calibration: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class StreamMap:
    """How the channels of one stream are read, and by which clock."""

    channels: dict[str, ChannelMap]
    source: str = "import"
    device_id: str = ""
    note: str = ""
    changes: bool | None = None
    """Keep only the rows in which a value differs from the row before. When a command holds does not depend on it."""
    time: Time | None = None
    """A clock of its own."""


@dataclass(frozen=True)
class FileMap:
    """How the lines of a file become cells, and which lines are no data."""

    kind: Literal["text", "parquet", "mat", "tdms", "mdf", "mcap", "bag", "ulog", "dataflash", "tlog"] = "text"
    """What the file is; of the others than text `message` and `where` alone count of these keys."""
    message: tuple[str, ...] = ()
    """Messages, topics, groups or structs of a binary log that become the table; none: all."""
    delimiter: str = ","
    """One character, `tab` or `whitespace`."""
    header: bool = True
    comment: str = ""
    skip_rows: int = 0
    encoding: str = "utf-8"
    """A byte-order mark is understood; bytes that are not UTF-8 are read as latin-1, and that is said."""
    ignore: tuple[str, ...] = ()
    """Lines with one of these texts are no data."""
    missing: tuple[str, ...] = ()
    """Cells that mean: nothing was measured."""
    width: int | None = None
    """Columns of a row; by default those of the header, without one the most frequent number."""
    decimal: Literal[".", ","] = "."
    where: str = ""
    """Rows that are wanted, as rig.importing.reading.row_filter reads it; empty: all."""


@dataclass(frozen=True)
class ImportMap:
    """A whole map: how a text file of another program becomes a recording."""

    about: str
    streams: dict[str, StreamMap]
    time: Time
    file: FileMap = field(default_factory=FileMap)
    kind: Literal["tunnel", "bollard", "vehicle"] = "tunnel"
    thruster: str = ""
    facility: str = ""
    origin: str = ""
    water_density: float | None = None
    notes: tuple[str, ...] = ()
    """Assumptions; they become events of the recording."""
    parameters: dict[str, float] = field(default_factory=dict)
    """Numbers for expressions; `--set name=value` overrides them."""
    columns: dict[str, Column] = field(default_factory=dict)
    header_values: dict[str, HeaderValue] = field(default_factory=dict)
    text: str = ""
    """The map itself, as read."""


def shipped() -> dict[str, Path]:
    """Maps that come with the program, by name."""
    folder = Path(str(files("rig.importing") / "maps"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def read_map(name: str) -> ImportMap:
    """A shipped map by name, or a file by path. Raises ConfigError that names file and key."""
    known = shipped()
    path = known.get(name, Path(name))
    try:
        text = read(path, "map", MOST_BYTES, ConfigError).decode("utf-8")
    except FileNotFoundError:
        near = difflib.get_close_matches(name, known, 1)
        hint = f"did you mean {near[0]}?" if near else "`rig import --list` shows those that are shipped"
        raise ConfigError(f"{name} is neither a shipped map nor a file; {hint}") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: this map can't be read: {error}") from None
    text = text.replace("\r\n", "\n")
    return build_map(parsed(text, path), text, path.name)


def build_map(content: Mapping[str, Any], text: str, where: str) -> ImportMap:
    """The map that a parsed TOML file describes; `text` is kept with it. Raises ConfigError that names `where`."""
    _known_keys(content, ImportMap, where, hidden=("text",))
    _known_keys(content.get("file", {}), FileMap, f"{where}: file")
    _known_keys(content.get("time", {}), Time, f"{where}: time")
    for name, stream in _tables(content, "streams", where):
        _known_keys(stream, StreamMap, f"{where}: streams.{name}")
        _known_keys(stream.get("time", {}), Time, f"{where}: streams.{name}.time")
        for channel, facts in _tables(stream, "channels", f"{where}: streams.{name}"):
            _known_keys(facts, ChannelMap, f"{where}: streams.{name}.channels.{channel}")
    for name, column in _tables(content, "columns", where):
        _known_keys(column, Column, f"{where}: columns.{name}")
    try:
        found = TypeAdapter(ImportMap).validate_python({**content, "text": text})
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"{where}: {key}: {first['msg']}, got {first['input']!r}") from error
    _check(found, where)
    return found


def _tables(content: Mapping[str, Any], key: str, where: str) -> list[tuple[str, Mapping[str, Any]]]:
    tables = content.get(key, {})
    if not isinstance(tables, Mapping) or not all(isinstance(table, Mapping) for table in tables.values()):
        raise ConfigError(f"{where}: {key} must be tables, [{key}.<name>]")
    return list(tables.items())


def _known_keys(content: Any, cls: type, where: str, hidden: tuple[str, ...] = ()) -> None:
    if not isinstance(content, Mapping):
        raise ConfigError(f"{where} must be a table, got {content!r}")
    known = [field.name for field in dataclasses.fields(cls) if field.name not in hidden]
    for key in content:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
            raise ConfigError(f"{where}: unknown key {key}; {hint}")


def _check(found: ImportMap, where: str) -> None:
    for clock, owner in [
        (found.time, "time"),
        *((s.time, f"streams.{n}.time") for n, s in found.streams.items() if s.time),
    ]:
        given = [name for name in ("column", "rate", "level_duration") if getattr(clock, name) is not None]
        if len(given) != 1:
            raise ConfigError(
                f"{where}: {owner} needs exactly one of column, rate, level_duration; has {given or 'none'}"
            )
        if clock.level_duration is not None and clock.levels is False:
            raise ConfigError(
                f"{where}: {owner}: level_duration is for a table of levels, and levels = false says none"
            )
        _told(partial(seconds, clock.unit), f"{where}: {owner}.unit")
    if found.file.delimiter not in ("tab", "whitespace") and len(found.file.delimiter) != 1:
        raise ConfigError(
            f"{where}: file.delimiter must be one character, tab or whitespace, got {found.file.delimiter!r}"
        )
    if found.file.where:
        _told(partial(parse, found.file.where), f"{where}: file.where")
    for name, column in found.columns.items():
        for factor in (factor for _, factor in column.any_of if isinstance(factor, str)):
            _told(partial(factor_to_si, factor), f"{where}: columns.{name}")
    for stream, channels in found.streams.items():
        for name, channel in channels.channels.items():
            _check_channel(channel, f"{where}: {stream}/{name}", found.parameters)


def _told(check: Callable[[], object], who: str) -> None:
    """Runs a check; what it refuses is said with the key before it."""
    try:
        check()
    except ConfigError as error:
        raise ConfigError(f"{who}: {error}") from error


def _check_times(channel: ChannelMap, who: str) -> None:
    for name in ("delay", "delay_std", "window", "low_pass"):
        value = getattr(channel, name)
        if value is not None and not 0.0 <= value <= LONGEST_DELAY:
            raise ConfigError(f"{who}: {name} must be between 0 and {LONGEST_DELAY:g} s, got {value}")
    if channel.delay is not None and channel.delay < (channel.low_pass or 0.0):
        raise ConfigError(
            f"{who}: delay holds the group delay of low_pass ({channel.low_pass:g} s) and is at least that, "
            f"got {channel.delay:g}"
        )


def _check_channel(channel: ChannelMap, who: str, parameters: Mapping[str, float]) -> None:
    if isinstance(channel.sign, str) and channel.sign not in parameters:
        raise ConfigError(f"{who}: sign must be 1, -1 or a name of [parameters], got {channel.sign!r}")
    if (channel.column is None) == (not channel.value):
        raise ConfigError(f"{who} needs either column or value")
    if channel.value:
        names_in(channel.value)
    _check_times(channel, who)
    if channel.quantity is None:
        return
    if channel.quantity not in QUANTITY_UNITS:
        raise ConfigError(f"{who}: {channel.quantity} is no quantity of the format: {', '.join(QUANTITY_UNITS)}")
    quantity, unit = channel.quantity, channel.unit
    if unit == FROM_HEADER and not isinstance(channel.column, str):
        raise ConfigError(f"{who}: unit = 'header' is for a channel whose `column` is a name of the header")
    if unit != FROM_HEADER:
        _told(partial(conversion, quantity, unit), who)
