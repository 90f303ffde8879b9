"""Recognition on a serial port: the line that a probe is handed, and what a probe is."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import NamedTuple

from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.recognition.found import Found


class Rate(NamedTuple):
    """Of a line."""

    baud: int
    framing: str = "8N1"

    def __str__(self) -> str:
        return f"{self.baud} {self.framing}"


BACKLOG = 0.1
"""s after the opening: what comes then had waited in the adapter, and would be taken for a faster device."""


class Line:
    """An open port. It stays open from rate to rate: each opening restarts an Arduino."""

    def __init__(self, port: str, rate: Rate, addresses: tuple[int, ...] = (1,), capture: str = "") -> None:
        """`addresses`: at which devices of a shared line (Modbus) are asked."""
        self.rate, self.addresses = rate, addresses
        self.heard = b""
        """What came at this rate without being asked for."""
        self.heard_for = 0.0
        """s"""
        self.answers = b""
        """All that came after questions at this rate."""
        self.mute: set[int] = set()
        """Addresses of a shared line that gave no byte when they were asked at this rate."""
        self.withheld: list[str] = []
        """What was not asked at this rate, and why."""
        settings = SerialSettings(port, rate.baud, rate.framing, capture)
        self._port: SerialPort[bytes] = SerialPort(port, settings, _as_it_is)

    def __enter__(self) -> Line:
        """Raises LinkError."""
        self._port.open()
        self._gather(BACKLOG, lambda _: False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._port.close()

    @property
    def alive(self) -> bool:
        return self._port.alive

    def retune(self, rate: Rate) -> None:
        """Another rate; what was heard before is forgotten. Raises LinkError where the port cannot do it."""
        self._port.retune(rate.baud, rate.framing)
        self.rate = rate
        self._port.inbox.take_all()
        self.heard, self.heard_for, self.answers = b"", 0.0, b""
        self.mute.clear()
        self.withheld = []

    def listen(self, seconds: float) -> bytes:
        """All that was heard at this rate, after another `seconds` of silence on our side."""
        begun = time.monotonic()
        self.heard += self._gather(seconds, lambda _: False)
        self.heard_for += time.monotonic() - begun
        return self.heard

    def ask(self, request: bytes, enough: Callable[[bytes], bool], timeout: float = 0.3) -> bytes:
        """What comes within `timeout` s of the question, at the latest until it is `enough`. Raises LinkError."""
        self._port.inbox.take_all()
        self._port.write(request)
        came = self._gather(timeout, enough)
        self.answers += came
        return came

    def _gather(self, seconds: float, enough: Callable[[bytes], bool]) -> bytes:
        came, deadline = b"", time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0 and not enough(came):
            chunk = self._port.inbox.wait_for(lambda _: True, left)
            if chunk is None and not self._port.alive:
                break
            came += chunk or b""
        return came


def _as_it_is(data: bytes) -> list[bytes]:
    return [data]


@dataclass(frozen=True, slots=True)
class SerialProbe:
    """How one kind is recognised on a serial port."""

    rates: tuple[Rate, ...]
    """At which it is asked, that of the factory first."""
    asks: str
    """What it is sent, in words; "nothing" where it is only listened to."""
    hear: Callable[[Line], Found | None]
    """From what the device says by itself, at any rate; None: it is not of this kind."""
    ask: Callable[[Line], Found | None] | None = None
    """By questions that a motor controller, of this kind or another, answers without moving."""
    order: int = 0
    """Lower comes first: text before binary frames, whatever is particular before whatever takes anything."""
    named_only: bool = False
    """It is asked only where the operator names the kind: another kind may take its questions for commands."""
