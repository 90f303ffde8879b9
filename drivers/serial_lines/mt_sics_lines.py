"""Lines of MT-SICS, the language of Mettler-Toledo balances and weigh modules: text to numbers and back.

Source: Mettler-Toledo, MT-SICS Interface Command Set, manuals 11780711 (balances) and 11781363 (weigh modules):
section 2.1.2 formats of replies, 2.1.3 error messages, chapter 3 commands @, I2, I4, SIR, TI, UPD.
Weight reply: `ID SP status SP value(10 characters, right aligned) SP unit CR LF`. There is no checksum.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from drivers.force_units import NEWTONS_PER_UNIT
from drivers.ports.lines import LineCutter, printable

LINE_CHARACTERS = 18
"""`S D   1234.567 N` CR LF (2.1.2.1)."""
INTERNAL_FAULTS = {
    1: "boot error", 2: "brand error", 3: "checksum error", 9: "option fail", 10: "EEPROM error",
    11: "device mismatch", 12: "hot plug out", 14: "weigh module and terminal mismatch", 15: "adjustment needed",
}  # fmt: skip
"""`S S Error nn(b|t)` (2.1.3.3); b from the electronics, t from the terminal."""
_NUMBER = re.compile(rb"[+-]?\d{1,20}\.?\d{0,20}")
"""Bounded: 310 digits would be an infinite force; the longest of the manual has ten characters."""
_REPLY = re.compile(rb"([A-Z@][A-Z0-9]{0,7})(?: ([ABILSD+-]))?(?: (.*))?")
_ERROR = re.compile(rb"(\d+)[bt]")


class Weight(NamedTuple):
    """A force reading in the unit the device shows. NaN with an empty unit: overload, underload or nothing to give."""

    value: float
    unit: str
    stable: bool


class Reply(NamedTuple):
    """An answer that is no weight: `I4 A "B123"` is command I4, status A, text `"B123"`."""

    command: str
    status: str
    text: str


class Fault(NamedTuple):
    """The device says that it is broken."""

    code: int


class Unreadable(NamedTuple):
    """A line that is no answer of MT-SICS."""

    line: bytes


Record = Weight | Reply | Fault | Unreadable
NOTHING = Weight(math.nan, "", stable=False)


def encode(command: str) -> bytes:
    """A command as the device wants it: upper case, CR LF. Raises ValueError for what the wire cannot carry."""
    if not command or command != command.upper() or not command.isascii() or not command.isprintable():
        raise ValueError(f"an MT-SICS command is upper-case printable ASCII, not {command!r}")
    return command.encode("ascii") + b"\r\n"


def decode(line: bytes) -> Record:
    """One line without CR LF. Any spacing; identifier `S` or (some devices) `SI`; a sign may stand apart."""
    words = line.split()
    if len(words) >= 2 and (words[0] == b"S" or words[0] == b"SI"):
        return _decode_weight(line, words)
    parts = _REPLY.fullmatch(b" ".join(words))
    if parts is None:
        return Unreadable(line)
    command, status, text = (printable(part or b"") for part in parts.groups())
    return Reply(command, status, text)


def _decode_weight(line: bytes, words: list[bytes]) -> Record:
    if len(words) == 2 and words[1] in (b"+", b"-", b"I"):
        return NOTHING
    if len(words) == 5 and words[2] in (b"+", b"-"):
        words = [*words[:2], words[2] + words[3], words[4]]
    if len(words) != 4 or words[1] not in (b"S", b"D"):
        return Unreadable(line)
    if words[2] == b"Error":
        code = _ERROR.fullmatch(words[3])
        return Fault(int(code[1])) if code else Unreadable(line)
    unit = printable(words[3])
    if _NUMBER.fullmatch(words[2]) is None or unit not in NEWTONS_PER_UNIT:
        return Unreadable(line)
    return Weight(float(words[2]), unit, words[1] == b"S")


def number(text: str) -> float | None:
    """A plain decimal as MT-SICS writes it (no exponent, no NaN); None for anything else."""
    return float(text) if _NUMBER.fullmatch(text.encode()) else None


class Decoder:
    """Bytes in any portions -> records."""

    def __init__(self) -> None:
        self._lines = LineCutter()

    def feed(self, data: bytes) -> list[Record]:
        return [decode(line) for line in self._lines.feed(data)]
