"""One CAN bus shared by several devices, through python-can. With serial_port.py the only place that opens wires.

Traps of python-can 4 that this file knows (seen in can/interfaces/slcan.py and tried): it reads an slcan adapter too
slowly for a full bus, so that slcan_lines.py does; it waits after each frame until the adapter has taken it, for ever
if the adapter is stuck; opening one sleeps 2 s unless told not to; shutdown of a lost port raises before closing it.
"""

from __future__ import annotations

import contextlib
import difflib
import fcntl
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
from can.interfaces import VALID_INTERFACES
from can.interfaces.slcan import slcanBus

from drivers.errors import LinkError
from drivers.ports.arrivals import Arrivals, Chunk
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords, Inbox
from drivers.ports.own_reader import OwnReader
from drivers.ports.reader import READ_TIMEOUT
from drivers.ports.refusals import why_not_open
from drivers.ports.serial_port import WRITE_TIMEOUT, descriptor_of, read, set_low_latency, write
from drivers.ports.slcan_lines import SlcanLines
from drivers.ports.transcript import Transcript
from drivers.ports.wire import SerialOverWire, Wire
from drivers.protocols import LinkHealth

CAPACITY = 100_000
"""Frames kept per device between two drains; 25 s of a full 500 kbit/s bus."""


class CanBus:
    """One bus; each device gets its own inbox of the frames it accepts."""

    def __init__(self, interface: str, channel: str, bitrate: int, capture: str = "", wire: Wire | None = None) -> None:
        """`wire`: to an slcan adapter, used instead of the port `channel`, with its stamps and in its time."""
        if not interface or not channel:
            raise ValueError("a CAN bus needs an interface (slcan, socketcan ...) and a channel (port or network name)")
        if interface not in VALID_INTERFACES:
            near = difflib.get_close_matches(interface, VALID_INTERFACES, 1)
            hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(sorted(VALID_INTERFACES))}"
            raise ValueError(f"python-can has no interface {interface!r}; {hint}")
        if bitrate <= 0:
            raise ValueError(f"CAN bitrate must be positive, not {bitrate}")
        if wire is not None and interface != "slcan":
            raise ValueError(f"only an slcan adapter can be reached over a wire, not {interface}")
        self._wire = wire
        self.error: str | None = None
        self._interface, self._channel, self._bitrate, self._capture = interface, channel, bitrate, capture
        self._bus: can.BusABC | None = None
        self._lock: int | None = None
        self._stop_reading: Callable[[], None] | None = None
        """Ends the reading."""
        self._transcript: Transcript | None = None
        self._inboxes: tuple[tuple[Callable[[Frame], bool], Inbox[Frame]], ...] = ()
        self._received = 0
        self._bad = BadRecords()
        self._lines = SlcanLines(self._bad, self._wanted)
        self._arrivals = Arrivals(self._decode, self._failed)

    @property
    def alive(self) -> bool:
        return self._bus is not None and self.error is None

    def open(self) -> None:
        """Open the adapter and start reading. Raises LinkError."""
        if self._bus is not None:
            return
        self.error, self._bad, self._received = None, BadRecords(), 0
        self._lines, self._arrivals = SlcanLines(self._bad, self._wanted), Arrivals(self._decode, self._failed)
        if self._wire is not None:
            self._transcript = Transcript(Path(self._capture)) if self._capture else None
            self._bus = self._over(self._wire)
            return
        try:
            self._lock = self._lock_port()
            self._transcript = Transcript(Path(self._capture)) if self._capture else None
            self._bus = can.Bus(self._channel, interface=self._interface, bitrate=self._bitrate, **self._special())
        except (can.CanError, OSError, ValueError) as error:
            self.close()
            raise LinkError(
                f"CAN bus {self._interface} on {self._channel} at {self._bitrate} bit/s does not open:"
                f" {why_not_open(error)}"
            ) from error
        self._stop_reading = self._read(self._bus)

    def subscribe(self, accept: Callable[[Frame], bool], capacity: int = CAPACITY) -> Inbox[Frame]:
        """An inbox that gets every frame for which `accept` is true, from now until the bus is closed.

        `accept` judges by the identifier: frames of one that nobody accepts are not made.
        """
        inbox: Inbox[Frame] = Inbox(capacity, self._wire, self._arrivals)
        self._arrivals.decode()
        self._inboxes = (*self._inboxes, (accept, inbox))
        self._lines.forget()
        return inbox

    def unsubscribe(self, inbox: Inbox[Frame]) -> None:
        self._inboxes = tuple(pair for pair in self._inboxes if pair[1] is not inbox)
        self._lines.forget()

    def send(self, frame: Frame) -> None:
        """Send once. Raises LinkError when the bus is closed, lost, or takes nothing for 0.2 s."""
        if self._bus is None or not self.alive:
            raise LinkError(f"CAN bus {self._channel}: {self.error or 'is not open'}")
        message = can.Message(arbitration_id=frame.id, is_extended_id=frame.extended, data=frame.data)
        sent_ns = self.now_ns()
        try:
            self._bus.send(message, timeout=WRITE_TIMEOUT)
        except (can.CanError, OSError) as error:
            why = error.__cause__ or error  # python-can's own words say that it could not write
            self.error = self.error or f"{self._channel} refused {frame} ({why}): check adapter, cable and power"
            raise LinkError(f"CAN bus {self.error}") from error
        if self._transcript is not None:
            self._transcript.write(sent_ns, ">", str(frame).encode())

    def now_ns(self) -> int:
        """Of the clock that stamps what arrives."""
        return time.monotonic_ns() if self._wire is None else round(self._wire.now() * 1e9)

    def health(self) -> LinkHealth:
        self._arrivals.decode()
        dropped = sum(inbox.dropped for _, inbox in self._inboxes)
        return LinkHealth(
            self.alive, self._received + self._lines.sound, self._bad.count, self._bad.first, self.error, dropped
        )

    def close(self) -> None:
        """Stop reading and let the adapter go. Safe to call twice and after a failure."""
        if self._stop_reading is not None:
            self._stop_reading()
        if self._bus is not None:
            _shut_down(self._bus)
        if self._lock is not None:
            os.close(self._lock)
        if self._transcript is not None:
            self._transcript.close()
        self._bus = self._stop_reading = self._lock = self._transcript = None
        self._inboxes = ()

    def _over(self, wire: Wire) -> can.BusABC:
        """An slcan bus on a wire: opened on a loop of its own, then given the wire and told to begin."""
        bus = slcanBus("loop://", sleep_after_open=0)
        bus.serialPortOrig.close()
        port = SerialOverWire(wire)
        bus.serialPortOrig = port  # type: ignore[assignment]  # all that slcanBus asks of a port

        wire.connect(self._arrived)
        bus.set_bitrate(self._bitrate)
        return bus

    def _special(self) -> dict[str, Any]:
        """slcan: no pause after opening."""
        return {"sleep_after_open": 0, "timeout": READ_TIMEOUT} if self._interface == "slcan" else {}

    def _lock_port(self) -> int | None:
        """Python-can opens an slcan port without asking whether another program uses it: the lock is taken here."""
        path = self._channel.split("@")[0]
        if self._interface != "slcan" or "://" in path:
            return None
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            raise
        return descriptor

    def _read(self, bus: can.BusABC) -> Callable[[], None]:
        """From now on; returns what ends that."""
        if isinstance(bus, slcanBus):
            port = bus.serialPortOrig
            set_low_latency(port)
            if descriptor_of(port) is not None:
                port.write = lambda data: write(port, bytes(data))  # type: ignore[method-assign]
                port.flush = lambda: None  # type: ignore[method-assign]
            return read(port, self._channel, self._arrived, self._lost)
        return OwnReader(self._channel, lambda: self._take_frame(bus), self._lost, (can.CanError, OSError)).end

    def _take_frame(self, bus: can.BusABC) -> None:
        """Of any other adapter, one by one."""
        if frames := _next_frame(bus, self._bad):
            self._received += len(frames)
            now_ns = time.monotonic_ns()
            self._deliver([(now_ns, frame) for frame in frames])

    def _lost(self, why: str) -> None:
        self.error = self.error or why
        self._arrivals.decode()
        self._end_inboxes()

    def _arrived(self, t_ns: int, data: bytes) -> None:
        """What an slcan adapter says; a transcript has all of it at once."""
        self._arrivals.add(t_ns, data)
        if self._transcript is not None:
            self._arrivals.decode()

    def _decode(self, chunks: list[Chunk]) -> None:
        if rows := [(t_ns, frame) for t_ns, data in chunks for frame in self._lines.feed(data)]:
            self._deliver(rows)

    def _wanted(self, identifier: int, extended: bool) -> bool:
        empty = Frame(identifier, extended, b"")
        return self._transcript is not None or any(accept(empty) for accept, _ in self._inboxes)

    def _failed(self) -> None:
        self.error = self.error or f"the decoder of {self._channel} stopped on an error of this program (see the log)"
        self._end_inboxes()

    def _end_inboxes(self) -> None:
        for _, inbox in self._inboxes:
            inbox.end()

    def _deliver(self, rows: list[tuple[int, Frame]]) -> None:
        """To each device its own of the frames, with when they came."""
        if self._transcript is not None:
            for t_ns, frame in rows:
                self._transcript.write(t_ns, "<", str(frame).encode())
        for accept, inbox in self._inboxes:
            if accepted := [row for row in rows if accept(row[1])]:
                inbox.put(accepted)


def _next_frame(bus: can.BusABC, bad: BadRecords) -> list[Frame]:
    """The next frame of any other adapter; none after READ_TIMEOUT, or where it holds no data."""
    message = bus.recv(READ_TIMEOUT)
    if message is None:
        return []
    frame = Frame(message.arbitration_id, message.is_extended_id, bytes(message.data))
    if message.is_error_frame or message.is_remote_frame or len(frame.data) != message.dlc:
        bad.add(f"{frame} of length {message.dlc}" + (" (error frame)" if message.is_error_frame else ""))
        return []
    return [frame]


def _shut_down(bus: can.BusABC) -> None:
    """Shut down, and close the port even where python-can's farewell fails on a lost cable and leaves it open."""
    with contextlib.suppress(can.CanError, OSError):
        bus.shutdown()
    port = getattr(bus, "serialPortOrig", None)
    if port is not None:
        with contextlib.suppress(OSError):
            port.close()
