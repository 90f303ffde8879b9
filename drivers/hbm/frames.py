"""What AED electronics say on a serial line: answers in text, measured values in four bytes or in text.

Source: HBM, AD104-R2/R5 operating manual (ba_aed104_8), chapter 6 (form of commands and answers, output of measured
values) and the pages of COF, TEX, MSV. A command ends with `;`, its answer with CR LF: `0` done, `?` refused. In the
binary form CR and LF may be bytes of a value: the manual says to count bytes, and here the end is looked for where
counting says that it is.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from drivers.ports.lines import MAX_LINE, LineCutter, printable

BINARY, ASCII = 8, 9
"""COF: three bytes of value, most significant first, and one of status; value, address and status in text."""
CHARACTERS = {BINARY: 6, ASCII: 17}
"""Of a measured value, with CR LF (manual p. 15)."""
FULL_SCALE = {BINARY: 5_120_000, ASCII: 1_000_000}
"""Digits at nominal load while NOV is 0 (p. 38)."""
DELIMITER = 172
"""TEX: commas within a measured value, CR LF after each (p. 25)."""
STANDSTILL = 0x08
"""Bit of the status (p. 38): the value stands still."""
STATUS_FAULTS = (
    "net overflow",
    "gross overflow",
    "converter overdriven",
    "",
    "",
    "",
    "values not coherent",
    "values not coherent",
)
"""Bits of the status, from bit 0, with which a value is none; empty: not one of these."""
END = b"\r\n"
LOOK = 4
"""Frames that must have their ends in their places before a place is believed."""
_ASCII_VALUE = re.compile(rb"([+-]?) *(\d{1,8}),(\d{1,2}),(\d{1,3})")


class Value(NamedTuple):
    """A measured value in digits, and its status byte."""

    digits: int
    status: int

    @property
    def valid(self) -> bool:
        return not any(name and self.status >> bit & 1 for bit, name in enumerate(STATUS_FAULTS))


class Answer(NamedTuple):
    """A line of text that is no measured value."""

    text: str


class Unreadable(NamedTuple):
    """Bytes that are neither."""

    line: bytes


Record = Value | Answer | Unreadable


def encode(command: str) -> bytes:
    """A command as the electronics want it. Raises ValueError for what is none."""
    if not command or not command.isascii() or not command.isprintable() or ";" in command:
        raise ValueError(f"an HBM command is printable ASCII without a semicolon, not {command!r}")
    return command.encode("ascii") + b";"


def decode_line(line: bytes) -> Record:
    """One line without CR LF. Never raises."""
    words = line.strip()
    if value := _ASCII_VALUE.fullmatch(words):
        sign, digits, _, status = value.groups()
        return Value(int(sign + digits), int(status)) if int(status) < 256 else Unreadable(line)
    text = words.decode("ascii", "replace")
    return Answer(text) if text.isascii() and text.isprintable() and text else Unreadable(line)


def decode_frame(frame: bytes) -> Value:
    """The four bytes of COF8."""
    return Value(int.from_bytes(frame[:3], "big", signed=True), frame[3])


class Decoder:
    """Bytes in any portions -> records. In text until `begin_binary`; the thread that reads finds out with the next
    bytes."""

    def __init__(self) -> None:
        self._lines = LineCutter()
        self._binary = False
        self._rest = b""
        self._lost = b""
        """Bytes passed over since the last frame that was in its place; empty: in step."""

    def begin_binary(self) -> None:
        """From now on frames of COF8 come, the next byte is the first of one."""
        self._rest = self._lost = b""
        self._binary = True

    def end_binary(self) -> None:
        self._binary, self._lines = False, LineCutter()

    def feed(self, data: bytes) -> list[Record]:
        if not self._binary:
            return [decode_line(line) for line in self._lines.feed(data)]
        self._rest += data
        records: list[Record] = []
        while (taken := self._take()) is not None:
            records += taken
        return records

    def _take(self) -> list[Record] | None:
        """A step further in what has come; None: more has to come."""
        if self._lost:
            return self._find_step()
        rest, size = self._rest, CHARACTERS[BINARY]
        if len(rest) < size:
            return None
        if rest[4:size] == END:
            self._rest = rest[size:]
            return [decode_frame(rest)]
        self._lost, self._rest = rest[:1], rest[1:]
        return []

    def _find_step(self) -> list[Record] | None:
        """Out of step: only where one place alone has its ends, `LOOK` frames long, it is believed."""
        rest, size = self._rest, CHARACTERS[BINARY]
        if len(rest) < size * (LOOK + 1):
            return None
        places = [at for at in range(size) if all(rest[at + size * i + 4 :].startswith(END) for i in range(LOOK))]
        skipped = places[0] if len(places) == 1 else size
        self._lost, self._rest = self._lost + rest[:skipped], rest[skipped:]
        if len(places) != 1 and len(self._lost) < MAX_LINE:
            return []
        lost, self._lost = self._lost, b"" if len(places) == 1 else b"\0"
        return [Unreadable(lost)]


def flags(status: int) -> str:
    """What is wrong with a value, in words."""
    return ", ".join(dict.fromkeys(name for bit, name in enumerate(STATUS_FAULTS) if name and status >> bit & 1))


def shown(record: Record | None) -> str:
    """A record as a person reads it."""
    match record:
        case None:
            return "nothing"
        case Answer(text):
            return repr(text)
        case Unreadable(line):
            return printable(line)
        case Value(digits, status):
            return f"{digits} (status {status})"
