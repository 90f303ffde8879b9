"""Which register of a weight transmitter says what: a TOML file a model, checked; and words of a reply to numbers.

Registers are numbers on the wire: that of the manual less 40001 (function 3) or 30001 (function 4).
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from drivers.force_units import NEWTONS_PER_UNIT

FOLDER = Path(__file__).parent
NumberType = Literal["u16", "i16", "u32", "i32", "magnitude", "float32"]
WordOrder = Literal["high_first", "low_first"]
Register = Annotated[int, Field(ge=0, le=0xFFFF)]
Bit = Annotated[int, Field(ge=0, le=15)]
_STRICT = ConfigDict(extra="forbid", strict=True)


@dataclass(frozen=True, slots=True)
class Reading:
    """`[readings.<name>]`: a weight."""

    __pydantic_config__ = _STRICT
    register: Register
    type: NumberType
    """magnitude: u32 without a sign, which is `negative` of the status register."""
    negative: Bit | None = None

    @property
    def count(self) -> int:
        return 1 if self.type in ("u16", "i16") else 2


@dataclass(frozen=True, slots=True)
class Status:
    """`[status]`: bits of one register, 0 the lowest."""

    __pydantic_config__ = _STRICT
    register: Register
    stable: Bit | None = None
    overload: tuple[Bit, ...] = ()
    underload: tuple[Bit, ...] = ()
    fault: tuple[Bit, ...] = ()
    """Broken cell, failed converter: no later value is believed."""


@dataclass(frozen=True, slots=True)
class Code:
    """`[unit]`, `[division]`: a code in a register, or in one byte of it, and what each stands for."""

    __pydantic_config__ = _STRICT
    register: Register
    codes: dict[str, str]
    """Code in decimal -> unit, or weight of one division such as "0.005"."""
    byte: Literal["high", "low", "both"] = "both"

    def said(self, word: int) -> tuple[int, str | None]:
        """The code in a register, and what it stands for; None: the map does not know it."""
        code = {"high": word >> 8, "low": word & 0xFF, "both": word}[self.byte]
        return code, self.codes.get(str(code))


@dataclass(frozen=True, slots=True)
class RegisterMap:
    """A map file."""

    __pydantic_config__ = _STRICT
    title: str
    source: str
    """Manual and page, or who tried it."""
    function: Literal[3, 4]
    readings: dict[str, Reading]
    """The first is read unless the bench file names another."""
    word_order: WordOrder = "high_first"
    """Of two registers: which word comes first, where the bench file does not say."""
    most_registers: Annotated[int, Field(ge=1, le=125)] = 125
    """In one request."""
    status: Status | None = None
    unit: Code | None = None
    division: Code | None = None
    notes: str = field(default="", compare=False)


_ADAPTER = TypeAdapter(RegisterMap)


def known_maps() -> tuple[str, ...]:
    """Names of the maps that come with the rig."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


@lru_cache(maxsize=32)
def load_map(name: str) -> RegisterMap:
    """A map by its name, or by the path of a file that ends in `.toml`. Raises ValueError with one sentence."""
    if not name.endswith(".toml"):
        if name not in known_maps():
            raise ValueError(
                f"modbus_cell map must be one of {', '.join(known_maps())}, or the path of a .toml file, not {name!r}"
            )
        path = FOLDER / f"{name}.toml"
    else:
        path = Path(name)
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"modbus_cell map {name} cannot be read ({error.strerror}): check the path") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"modbus_cell map {name} is not TOML: {error}") from error
    try:
        found = _ADAPTER.validate_json(_json(tables))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ValueError(f"modbus_cell map {name}: {where}: {first['msg']}, got {first['input']!r}") from error
    _check(name, found)
    return found


def _json(tables: object) -> str:
    """TOML as JSON: strict in its types, with arrays for tuples."""
    return json.dumps(tables, default=str)


def _check(name: str, found: RegisterMap) -> None:
    if not found.readings:
        raise ValueError(f"modbus_cell map {name}: needs a table [readings.<name>] with register and type")
    for which, reading in found.readings.items():
        if (reading.type == "magnitude") != (reading.negative is not None):
            raise ValueError(
                f"modbus_cell map {name}: readings.{which}: a magnitude needs `negative`,"
                " the bit of its sign, and others have none"
            )
        if reading.negative is not None and found.status is None:
            raise ValueError(f"modbus_cell map {name}: readings.{which} has its sign in [status], which is missing")
        span(found, reading)
    for unit in found.unit.codes.values() if found.unit else ():
        if unit and unit not in NEWTONS_PER_UNIT:
            raise ValueError(
                f"modbus_cell map {name}: unit.codes: {unit!r} is none of {', '.join(NEWTONS_PER_UNIT)};"
                ' what is no force is ""'
            )
    for step in found.division.codes.values() if found.division else ():
        if not step.replace(".", "", 1).isdigit() or float(step) == 0.0:
            raise ValueError(f'modbus_cell map {name}: division.codes: {step!r} is no weight such as "0.005"')


def span(found: RegisterMap, reading: Reading) -> tuple[int, int]:
    """First register and how many: reading and status in one request. Raises ValueError where they are far apart."""
    registers = [reading.register, reading.register + reading.count - 1]
    registers += [found.status.register] if found.status else []
    count = max(registers) - min(registers) + 1
    if count > found.most_registers:
        raise ValueError(
            f"modbus_cell map {found.title}: reading and status are {count} registers apart, more than the"
            f" {found.most_registers} of one request: a sample must not be put together from two"
        )
    return min(registers), count
