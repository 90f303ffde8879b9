"""Which signals of a DBC file are channels: a TOML file beside it, checked against it.

The DBC file is read by cantools, which is loaded here when a bench names this kind of device, and not before: it takes
a noticeable part of a second, and is not part of a base install.
"""

from __future__ import annotations

import json
import math
import tomllib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ConfigDict, TypeAdapter, ValidationError

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

_STRICT = ConfigDict(extra="forbid", strict=True)
MISSING_EXTRA = "can_signals needs the Python package cantools, which is not installed: pip install 'thruster-rig[dbc]'"


@dataclass(frozen=True, slots=True)
class SignalChannel:
    """`[channels.<name>]`: value = scale * (factor * number + bias) + offset, with factor and bias of the DBC file."""

    __pydantic_config__ = _STRICT
    signal: str
    """`MESSAGE.SIGNAL` of the DBC file."""
    unit: str
    """SI unit of the value; `1` for a number without one."""
    scale: float = 1.0
    offset: float = 0.0
    quantity: str | None = None
    """Of the recording format; None: kept, not used."""
    absent: tuple[int, ...] = ()
    """Numbers in the frame that stand for no value."""
    noise_std: float | None = None
    range_min: float | None = None
    range_max: float | None = None

    @property
    def message(self) -> str:
        return self.signal.partition(".")[0]

    @property
    def name_in_message(self) -> str:
        return self.signal.partition(".")[2]

    def value(self, number: float, factor: float, bias: float) -> float:
        """NaN where the signal has no value."""
        if number in self.absent or not math.isfinite(number):
            return math.nan
        return self.scale * (factor * number + bias) + self.offset


@dataclass(frozen=True, slots=True)
class SignalMap:
    """A map file."""

    __pydantic_config__ = _STRICT
    title: str
    source: str
    """Where the DBC file is from, or who tried it."""
    dbc: str
    """Its path; a relative one is relative to the map."""
    rates: dict[str, float]
    """Message -> how often it is sent, 1/s."""
    channels: dict[str, SignalChannel]
    notes: str = field(default="", compare=False)

    def of_message(self, message: str) -> dict[str, SignalChannel]:
        return {name: channel for name, channel in self.channels.items() if channel.message == message}


_ADAPTER = TypeAdapter(SignalMap)


@lru_cache(maxsize=32)
def load_signals(name: str) -> tuple[SignalMap, dict[str, Message]]:
    """The map of a file, and the messages of its DBC file that it names. Raises ValueError with one sentence."""
    try:
        tables = tomllib.loads(Path(name).read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"can_signals map {name} cannot be read ({error.strerror}): check the path") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"can_signals map {name} is not TOML: {error}") from error
    try:
        found = _ADAPTER.validate_json(json.dumps(tables, default=str))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"can_signals map {name}: {where}: {first['msg']}, got {first['input']!r}") from error
    database = _database(name, Path(name).parent / found.dbc)
    messages = {channel.message: _message(name, database, channel.message) for channel in found.channels.values()}
    _check(name, found, messages)
    return found, messages


def _database(name: str, path: Path) -> Database:
    try:
        from cantools.database import load_file
        from cantools.errors import Error
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != "cantools":
            raise
        raise ValueError(MISSING_EXTRA) from error
    try:
        database = load_file(path, database_format="dbc")
    except OSError as error:
        raise ValueError(f"can_signals map {name}: dbc {path} cannot be read ({error.strerror})") from error
    except (Error, UnicodeDecodeError) as error:
        raise ValueError(f"can_signals map {name}: dbc {path} is no DBC file: {error}") from error
    return database  # type: ignore[return-value]  # the other kind of cantools is a CDD file's


def _message(name: str, database: Database, wanted: str) -> Message:
    for message in database.messages:
        if message.name == wanted:
            return message
    known = ", ".join(message.name for message in database.messages[:20])
    raise ValueError(f"can_signals map {name}: the DBC file has no message {wanted!r}, but {known}")


def _check(name: str, found: SignalMap, messages: dict[str, Message]) -> None:
    if not found.channels:
        raise ValueError(f"can_signals map {name}: needs a table [channels.<name>] with signal and unit")
    for which, channel in found.channels.items():
        at = f"can_signals map {name}: channels.{which}"
        if not which.isidentifier():
            raise ValueError(f"{at}: a channel's name has letters, digits and _ alone")
        if not math.isfinite(channel.scale) or channel.scale == 0.0 or not math.isfinite(channel.offset):
            raise ValueError(f"{at}: scale must be finite and not 0, offset finite")
        signals = [signal.name for signal in messages[channel.message].signals]
        if channel.name_in_message not in signals:
            raise ValueError(f"{at}: signal must be MESSAGE.SIGNAL; {channel.message} has {', '.join(signals)}")
    for message in messages:
        rate = found.rates.get(message, 0.0)
        if not 0.0 < rate <= 1e4:
            raise ValueError(f"can_signals map {name}: rates.{message} must be its frames/s, up to 10000, not {rate:g}")
    if strange := set(found.rates) - set(messages):
        raise ValueError(f"can_signals map {name}: rates has {', '.join(sorted(strange))}, of which no channel is")


def signal_of(message: Message, channel: SignalChannel) -> Signal:
    """The signal of a channel that was checked."""
    return message.get_signal_by_name(channel.name_in_message)
