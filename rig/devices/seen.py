"""What a look at a port or a bus gave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from drivers.recognition.found import Found
from drivers.recognition.serial_line import Rate


class Tried(NamedTuple):
    """One rate of a port."""

    rate: Rate
    heard: bytes
    """Without asking."""
    answers: bytes
    asked: tuple[str, ...]
    """Kinds."""
    withheld: tuple[str, ...] = ()
    """What was not asked, and why."""


@dataclass(frozen=True, slots=True)
class PortSeen:
    """A serial port: with `found` who is there, at `rate`; without, what was tried."""

    port: str
    tried: tuple[Tried, ...]
    found: Found | None = None
    rate: Rate | None = None
    error: str = ""
    """Why it could not be looked at."""


class Bus(NamedTuple):
    """As a bench file has it."""

    interface: str
    channel: str
    bitrate: int

    def __str__(self) -> str:
        return f"{self.interface}:{self.channel}@{self.bitrate}"


@dataclass(frozen=True, slots=True)
class BusSeen:
    """A CAN bus: who is there, and frames of whom nobody knows."""

    bus: Bus
    found: tuple[Found, ...] = ()
    frames: int = 0
    """Heard without asking."""
    strangers: tuple[str, ...] = ()
    """The first frames that are of no known kind."""
    bad: int = 0
    """Frames or lines of the adapter that could not be read."""
    asked: tuple[str, ...] = ()
    """Kinds."""
    error: str = ""
