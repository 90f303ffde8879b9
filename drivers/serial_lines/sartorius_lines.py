"""Lines of Sartorius' SBI protocol (balances, weigh cells WZ and WZA, Minebea scales): text to numbers and back.

Source: Sartorius, Cubis MSE operating instructions (data interfaces, SBI commands); GC and WZA weigh cells (data output
with 16 and 22 characters). A command is ESC, a letter, or a letter, a number and `_`; CR LF may follow. An answer is a
sign, a blank, eight characters of value, a blank and three of unit, CR LF; with an identifier of six characters before
it where the balance is set to 22. The unit is blank while the balance is not stable. There is no checksum.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

SHORT, LONG = 14, 20
"""Characters of an answer without CR LF, without and with identifier."""
ANSWER_CHARACTERS = LONG + 2
PRINT = "P"
MODEL, SERIAL, VERSION = "x1_", "x2_", "x3_"
OUT_OF_RANGE = ("High", "H", "Low", "L")
"""In the place of a value: beyond the range."""
_COMMAND = re.compile(r"[A-Z]|[a-z]{1,2}\d{0,2}_")
_WEIGHT = re.compile(r"([ +-])([ \d.\[\]]{10})([A-Za-z% ]{3})")
_DIGITS = re.compile(r"\d{1,9}(?:\.\d{0,8})?")
_ERROR = re.compile(r"Err\.? *(\d{1,3})")


class Weight(NamedTuple):
    """A reading in the unit that is shown; empty: not stable. NaN: out of range."""

    value: float
    unit: str


class Fault(NamedTuple):
    """The balance says that it has no reading: `Err 54`, `OFF`."""

    text: str


class Text(NamedTuple):
    """A line that is none of these: an answer to who it is."""

    text: str


class Unreadable(NamedTuple):
    """A line that is no text."""

    line: bytes


Record = Weight | Fault | Text | Unreadable


def encode(command: str) -> bytes:
    """ESC, command, CR LF. Raises ValueError for what is no command of SBI."""
    if _COMMAND.fullmatch(command) is None:
        raise ValueError(f"an SBI command is a capital letter, or letters, a number and _, not {command!r}")
    return f"\x1b{command}\r\n".encode("ascii")


def decode(line: bytes) -> Record:
    """One line without its CR LF. Never raises."""
    if not line.isascii() or not (text := line.decode("ascii")).isprintable():
        return Unreadable(line)
    bare = text[LONG - SHORT :] if len(text) == LONG else text
    found = _WEIGHT.fullmatch(bare)
    digits = found[2].translate({ord(each): None for each in " []"}) if found else ""
    if found and _DIGITS.fullmatch(digits):
        return Weight(float(f"{found[1].strip()}{digits}"), found[3].strip())
    said = bare.strip()
    if said in OUT_OF_RANGE:
        return Weight(math.nan, "")
    error = _ERROR.search(text)
    if error or said == "OFF":
        return Fault(f"Err {error[1]}" if error else said)
    return Text(text.strip())
