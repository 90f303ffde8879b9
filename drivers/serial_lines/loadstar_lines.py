"""Lines of Loadstar's DI-100 and DI-1000 interfaces: text to values and counts, and commands to text. Pure.

Source: Loadstar Sensors, "DI-100U/DI-1000U command set" and "DI-1000UHS-1K output formats": a command ends with CR, in
either case; an answer ends with CR LF. `WC` sends values as `%12.4f`. `H` sends raw counts: a minus sign or a blank,
six hexadecimal digits of the magnitude, and CR alone. An empty command ends either, and is answered `A`.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from drivers.force_units import NEWTONS_PER_UNIT
from drivers.ports.lines import LineCutter

VALUE_CHARACTERS = 14
"""`%12.4f` CR LF."""
COUNT_CHARACTERS = 8
"""Sign, six digits, CR."""
IGNORED_COUNT = -1
"""What the interface sends now and then in the place of a count, "just ignore this value"."""
UNITS = {
    "n": 1.0,
    "kn": 1e3,
    "g": NEWTONS_PER_UNIT["g"],
    "gf": NEWTONS_PER_UNIT["g"],
    "kg": NEWTONS_PER_UNIT["kg"],
    "kgf": NEWTONS_PER_UNIT["kg"],
    "lb": NEWTONS_PER_UNIT["lb"],
    "lbf": NEWTONS_PER_UNIT["lb"],
    "oz": NEWTONS_PER_UNIT["oz"],
    "ozf": NEWTONS_PER_UNIT["oz"],
}
"""N per unit of force, by its name in small letters."""
_VALUE = re.compile(rb" *(-?\d{1,9}\.\d{4})")
_COUNT = re.compile(rb"([ -])([0-9A-Fa-f]{6})")


class Value(NamedTuple):
    """A reading in the unit that the interface is set to."""

    value: float


class Counts(NamedTuple):
    """A raw count of the converter."""

    counts: int


class Text(NamedTuple):
    """Any other line: an answer, or one that was spoilt."""

    line: bytes

    @property
    def words(self) -> str:
        return self.line.decode("ascii", errors="backslashreplace").strip()


Record = Value | Counts | Text


def decode(line: bytes) -> Record:
    """One line without CR and LF. Never raises. A value has at least 12 characters: one that lost some is none."""
    if (value := _VALUE.fullmatch(line)) and len(line) >= VALUE_CHARACTERS - 2:
        return Value(float(value[1]))
    if count := _COUNT.fullmatch(line):
        return Counts(int(count[2], 16) * (-1 if count[1] == b"-" else 1))
    return Text(line)


def encode(command: str) -> bytes:
    """A command as the interface wants it. Raises ValueError for what is none."""
    if not command.isascii() or not (command.isprintable() or not command):
        raise ValueError(f"a Loadstar command is printable ASCII, not {command!r}")
    return command.encode("ascii") + b"\r"


class Decoder:
    """Bytes in any portions -> records."""

    def __init__(self) -> None:
        self._lines = LineCutter()

    def feed(self, data: bytes) -> list[Record]:
        return [decode(line) for line in self._lines.feed(data)]
