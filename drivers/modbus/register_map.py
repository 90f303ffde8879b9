"""Which registers of any Modbus device are channels: a TOML file, checked; and the requests that read them.

Registers are numbers on the wire: that of the manual less 40001 (function 3) or 30001 (function 4).
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from drivers.modbus.maps import Register, WordOrder
from drivers.modbus.maps.numbers import number
from drivers.modbus.rtu import MOST_REGISTERS

_STRICT = ConfigDict(extra="forbid", strict=True)


@dataclass(frozen=True, slots=True)
class RegisterChannel:
    """`[channels.<name>]`: value = scale * number + offset."""

    __pydantic_config__ = _STRICT
    register: Register
    type: Literal["u16", "i16", "u32", "i32", "float32"]
    unit: str
    """SI unit of the value; `1` for a number without one."""
    scale: float = 1.0
    offset: float = 0.0
    quantity: str | None = None
    """Of the recording format; None: kept, not used."""
    bit: Annotated[int, Field(ge=0, le=15)] | None = None
    """Of a u16: the value is 1 where it is set, else 0."""
    invert: bool = False
    """Of a bit: 1 where it is not set, as of a contact that opens."""
    absent: tuple[int, ...] = ()
    """Numbers that stand for no value (a broken sensor)."""
    noise_std: float | None = None
    """Known noise of one value (1 sigma), in `unit`."""
    range_min: float | None = None
    range_max: float | None = None

    @property
    def count(self) -> int:
        return 1 if self.type in ("u16", "i16") else 2

    def value(self, words: Sequence[int], order: WordOrder) -> float:
        """Of its one or two words as they came; NaN where there is none."""
        raw = number(words, self.type, order)
        if not math.isfinite(raw) or raw in self.absent:
            return math.nan
        if self.bit is not None:
            return float((int(raw) >> self.bit & 1) != self.invert)
        return self.scale * raw + self.offset


@dataclass(frozen=True, slots=True)
class ChannelMap:
    """A map file."""

    __pydantic_config__ = _STRICT
    title: str
    source: str
    """Manual and page, or who tried it."""
    function: Literal[3, 4]
    channels: dict[str, RegisterChannel]
    word_order: WordOrder = "high_first"
    most_registers: Annotated[int, Field(ge=1, le=MOST_REGISTERS)] = MOST_REGISTERS
    """In one request."""
    gaps: bool = True
    """Whether registers between two channels may be read; false: a device answers to what is in its table alone."""
    notes: str = field(default="", compare=False)


class Block(NamedTuple):
    """One request, and the channels that it reads: a row."""

    register: int
    registers: int
    names: tuple[str, ...]


_ADAPTER = TypeAdapter(ChannelMap)


@lru_cache(maxsize=32)
def load_channels(name: str) -> ChannelMap:
    """The map of a file. Raises ValueError with one sentence."""
    try:
        tables = tomllib.loads(Path(name).read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"modbus_registers map {name} cannot be read ({error.strerror}): check the path") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"modbus_registers map {name} is not TOML: {error}") from error
    try:
        found = _ADAPTER.validate_json(json.dumps(tables, default=str))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"modbus_registers map {name}: {where}: {first['msg']}, got {first['input']!r}") from error
    _check(name, found)
    return found


def _check(name: str, found: ChannelMap) -> None:
    if not found.channels:
        raise ValueError(f"modbus_registers map {name}: needs a table [channels.<name>] with register, type and unit")
    for which, channel in found.channels.items():
        at = f"modbus_registers map {name}: channels.{which}"
        if not which.isidentifier():
            raise ValueError(f"{at}: a channel's name has letters, digits and _ alone")
        if channel.bit is not None and channel.type != "u16":
            raise ValueError(f"{at}: only a u16 has a bit, not a {channel.type}")
        if channel.invert and channel.bit is None:
            raise ValueError(f"{at}: only a bit is inverted; for a number give scale = -1")
        if not math.isfinite(channel.scale) or channel.scale == 0.0 or not math.isfinite(channel.offset):
            raise ValueError(f"{at}: scale must be finite and not 0, offset finite")
        if channel.count > found.most_registers:
            raise ValueError(f"{at}: {channel.count} registers, more than the {found.most_registers} of one request")


def blocks(found: ChannelMap, wanted: Sequence[str]) -> tuple[Block, ...]:
    """As few requests as the device allows, in the order of its registers."""
    made: list[Block] = []
    for name in sorted(wanted, key=lambda each: found.channels[each].register):
        channel = found.channels[name]
        end = channel.register + channel.count
        if made and _fits(found, made[-1], channel.register, end):
            last = made[-1]
            made[-1] = Block(last.register, max(last.registers, end - last.register), (*last.names, name))
        else:
            made.append(Block(channel.register, channel.count, (name,)))
    return tuple(made)


def _fits(found: ChannelMap, block: Block, begin: int, end: int) -> bool:
    near = found.gaps or begin <= block.register + block.registers
    return near and end - block.register <= found.most_registers
