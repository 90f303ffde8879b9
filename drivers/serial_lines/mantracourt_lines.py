"""Lines of Mantracourt's ASCII protocol (DSC, DCell, DLC, DSCUSB): text to numbers and back.

Source: Mantracourt, DCell & DSC user manual (2nd generation), p. 50: `!SSS:NAME?` CR reads, the answer is a number with
sign and DP digits after the point, and CR; `?` CR refuses; CR alone accepts; no answer within 50 ms is none. Bits of
STAT: labtools, mantracourt/dscusb.py (A. Petelin), which drives a DSCUSB. There is no checksum, and an answer does not
say which question it answers.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from drivers.ports.lines import LineCutter

ANSWER_TIME = 0.05
"""s after which there is no answer (p. 50)."""
OLD = 1 << 13
"""STAT, OLDVAL: the value was read before."""
NO_VALUE = {
    4: "strain gauge below its range",
    5: "strain gauge above its range",
    6: "cell below its range",
    7: "cell above its range",
    8: "system below its range",
    9: "system above its range",
}
"""Bits of STAT with which a value is none."""
BROKEN = {11: "load cell integrity error", 12: "shunt calibration is on"}
"""Bits of STAT with which no value is believed."""
_NUMBER = re.compile(rb"[+-]\d{1,9}\.?\d{0,9}")
_NAME = re.compile(r"[A-Z0-9]{1,4}")


class Number(NamedTuple):
    """The answer to a question, and how many digits it has after its point."""

    value: float
    decimals: int


class Refused(NamedTuple):
    """`?`"""


class Unreadable(NamedTuple):
    """A line that is none of these."""

    line: bytes


Record = Number | Refused | Unreadable


def question(station: int, name: str) -> bytes:
    """`!001:SYS?` CR. Raises ValueError for a name or station that the wire cannot carry."""
    if _NAME.fullmatch(name) is None or not 1 <= station <= 999:
        raise ValueError(
            f"Mantracourt asks one station of 1 to 999 for a name of 1 to 4 letters, not {station} {name!r}"
        )
    return f"!{station:03d}:{name}?\r".encode("ascii")


def decode(line: bytes) -> Record:
    """One line without its CR. Never raises."""
    if line == b"?":
        return Refused()
    if _NUMBER.fullmatch(line):
        return Number(float(line), len(line.partition(b".")[2]))
    return Unreadable(line)


def told(status: int, meanings: dict[int, str]) -> str:
    """Those of `meanings` whose bit is set, in words."""
    return ", ".join(words for bit, words in meanings.items() if status >> bit & 1)


class Decoder:
    """Bytes in any portions -> records."""

    def __init__(self) -> None:
        self._lines = LineCutter()

    def feed(self, data: bytes) -> list[Record]:
        return [decode(line) for line in self._lines.feed(data)]
