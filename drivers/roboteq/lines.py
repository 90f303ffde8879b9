"""Lines of Roboteq motor controllers on a serial port: text to numbers and back.

Source: Roboteq, Advanced Digital Motor Controller manual V1.8, V2.0 and V2.1, chapters on serial operation and on the
commands reference. A command ends with CR; `+` CR accepts, `-` CR refuses it. A query is answered by `NAME=v1:v2:...`
CR, whole numbers all. Unless echo is off the controller sends each character that it gets back as well. No checksum.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from drivers.ports.lines import LineCutter, printable

FAULTS = (
    "overheat",
    "overvoltage",
    "undervoltage",
    "short circuit",
    "emergency stop",
    "sensor or setup fault",
    "MOSFET failure",
    "default configuration loaded",
)
"""Bits of `?FF`, from bit 0."""
MOTOR_FLAGS = (
    "",  # amps limit: the power is cut back, which P tells
    "stall detected",
    "loop error",
    "safety stop",
    "forward limit",
    "reverse limit",
    "amps trigger",
)
"""Bits of `?FM`, from bit 0, that keep the motor from doing what it is told; empty: none of these."""
STATUS_FLAGS = ("", "commanded by a pulse input", "commanded by an analogue input", "power stage off")
"""The same of `?FS`."""
OPEN_LOOP = 0
"""`~MMOD`: the command is the share of the supply's voltage. Others close a loop around speed, position or torque."""
FULL = 1000
"""Per mille: a command or power of the whole supply voltage."""
TEXTS = ("FID", "TRN")
"""Queries that are answered by text: firmware, model."""
_NUMBERS = re.compile(rb"([A-Z]{1,6})=(-?\d{1,10}(?::-?\d{1,10}){0,15})")
_TEXT = re.compile(rb"(FID|TRN)=([ -~]{1,200})")
_ECHO = re.compile(rb"[!?~^#%][^=]*")


class Answer(NamedTuple):
    """`A=12:-3` is name A, values (12, -3)."""

    name: str
    values: tuple[int, ...]


class Text(NamedTuple):
    """An answer in words."""

    name: str
    text: str


class Accepted(NamedTuple):
    """`+`"""


class Refused(NamedTuple):
    """`-`"""


class Echo(NamedTuple):
    """What the controller was sent, sent back."""

    line: bytes


class Unreadable(NamedTuple):
    """A line that is none of these."""

    line: bytes


Record = Answer | Text | Accepted | Refused | Echo | Unreadable


def encode(command: str) -> bytes:
    """A command or query as the controller wants it. Raises ValueError for what is none."""
    if command[:1] not in set("!?~^") or not command.isascii() or not command.isprintable() or "_" in command:
        raise ValueError(f"a Roboteq command begins with one of ! ? ~ ^ and is printable without _, not {command!r}")
    return command.encode("ascii") + b"\r"


def go(channel: int, per_mille: int) -> bytes:
    """`!G`: the motor's command, in thousandths of the whole. Raises ValueError beyond them."""
    if not -FULL <= per_mille <= FULL:
        raise ValueError(f"a Roboteq command is -1000 to 1000, not {per_mille}")
    return encode(f"!G {channel} {per_mille}")


def decode(line: bytes) -> Record:
    """One line without its CR. Never raises."""
    words = line.strip()
    if words == b"+":
        return Accepted()
    if words == b"-":
        return Refused()
    if numbers := _NUMBERS.fullmatch(words):
        return Answer(numbers[1].decode("ascii"), tuple(int(value) for value in numbers[2].split(b":")))
    if text := _TEXT.fullmatch(words):
        return Text(text[1].decode("ascii"), printable(text[2]).strip())
    return Echo(line) if _ECHO.fullmatch(words) else Unreadable(line)


def of_channel(values: tuple[int, ...], channel: int) -> int:
    """The value of one channel: a controller asked for one gives it alone, or those of all its channels."""
    return values[channel - 1] if 1 <= channel <= len(values) else values[0]


def flags(value: int, names: tuple[str, ...]) -> str:
    """The names of the bits that are set, those without a name left out."""
    return ", ".join(name for bit, name in enumerate(names) if name and value >> bit & 1)


class Decoder:
    """Bytes in any portions -> records."""

    def __init__(self) -> None:
        self._lines = LineCutter()

    def feed(self, data: bytes) -> list[Record]:
        return [decode(line) for line in self._lines.feed(data)]
