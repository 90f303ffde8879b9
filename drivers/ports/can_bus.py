"""One CAN bus shared by several devices, through python-can. With serial_port.py the only place that opens wires.

Traps of python-can 4 that this file knows (seen in can/interfaces/slcan.py and tried):
a malformed line raises bare ValueError or IndexError out of recv; a byte above 7F raises what looks like a lost port
(CanOperationError from UnicodeDecodeError) and stays in its buffer, spoiling every later line until flush(); opening
sleeps 2 s unless told not to; shutdown of a lost port raises before closing it.
"""

from __future__ import annotations

import contextlib
import difflib
import fcntl
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import can
from can.interfaces import VALID_INTERFACES
from can.interfaces.slcan import slcanBus

from drivers.errors import LinkError
from drivers.ports.inbox import BadRecords, Inbox
from drivers.ports.transcript import Transcript
from drivers.ports.wire import SerialOverWire, Wire
from drivers.protocols import LinkHealth

READ_TIMEOUT = 0.05
"""s; how soon an idle reader notices that it shall stop."""
SEND_TIMEOUT = 0.2
"""s; an adapter that takes no bytes for this long has lost its bus or its cable. Time spent preempted counts for
pyserial too, even when every byte went out at once: hence well above a scheduling hiccup, and below the lateness that
the loop allows."""
JOIN_TIMEOUT = 2.0
"""s; forty times what the reader needs to stop."""
CAPACITY = 100_000
"""Frames kept per device between two drains; 25 s of a full 500 kbit/s bus."""


class Frame(NamedTuple):
    """One frame of a CAN bus: an identifier of 11 bits, or of 29 where it is `extended`, and up to 8 bytes."""

    id: int
    extended: bool
    data: bytes

    def __str__(self) -> str:
        return f"{self.id:08X}#{self.data.hex(' ')}" if self.extended else f"{self.id:03X}#{self.data.hex(' ')}"


class CanBus:
    """A bus with one reader thread; each device gets its own inbox of the frames it accepts."""

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
        self._reader: threading.Thread | None = None
        self._transcript: Transcript | None = None
        self._closing = threading.Event()
        self._inboxes: tuple[tuple[Callable[[Frame], bool], Inbox[Frame]], ...] = ()
        self._received = 0
        self._bad = BadRecords()

    @property
    def alive(self) -> bool:
        return self._bus is not None and self.error is None

    def open(self) -> None:
        """Open the adapter and start reading. Raises LinkError."""
        if self._bus is not None:
            return
        self.error, self._bad, self._received = None, BadRecords(), 0
        self._closing.clear()
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
                f"CAN bus {self._interface} on {self._channel} at {self._bitrate} bit/s does not open: {error}."
                " Check adapter, path, bit rate, and that no other program has it open"
            ) from error
        self._reader = threading.Thread(
            target=self._read, args=(self._bus,), name=f"read {self._channel}", daemon=False
        )
        self._reader.start()

    def subscribe(self, accept: Callable[[Frame], bool], capacity: int = CAPACITY) -> Inbox[Frame]:
        """An inbox that gets every frame for which `accept` is true, from now until the bus is closed."""
        inbox: Inbox[Frame] = Inbox(capacity, self._wire)
        self._inboxes = (*self._inboxes, (accept, inbox))
        return inbox

    def unsubscribe(self, inbox: Inbox[Frame]) -> None:
        self._inboxes = tuple(pair for pair in self._inboxes if pair[1] is not inbox)

    def send(self, frame: Frame) -> None:
        """Send once. Raises LinkError when the bus is closed, lost, or takes nothing for 0.2 s."""
        if self._bus is None or not self.alive:
            raise LinkError(f"CAN bus {self._channel}: {self.error or 'is not open'}")
        message = can.Message(arbitration_id=frame.id, is_extended_id=frame.extended, data=frame.data)
        try:
            self._bus.send(message, timeout=SEND_TIMEOUT)
        except (can.CanError, OSError) as error:
            self.error = self.error or f"{self._channel} refused {frame} ({error}): check adapter, cable and power"
            raise LinkError(f"CAN bus {self.error}") from error
        if self._transcript is not None:
            self._transcript.write(self.now_ns(), ">", str(frame).encode())

    def now_ns(self) -> int:
        """Of the clock that stamps what arrives."""
        return time.monotonic_ns() if self._wire is None else round(self._wire.now() * 1e9)

    def health(self) -> LinkHealth:
        dropped = sum(inbox.dropped for _, inbox in self._inboxes)
        return LinkHealth(self.alive, self._received, self._bad.count, self._bad.first, self.error, dropped)

    def close(self) -> None:
        """Stop reading and let the adapter go. Safe to call twice and after a failure."""
        self._closing.set()
        if self._reader is not None:
            self._reader.join(JOIN_TIMEOUT)
        if self._bus is not None:
            _shut_down(self._bus)
        if self._lock is not None:
            os.close(self._lock)
        if self._transcript is not None:
            self._transcript.close()
        self._bus = self._reader = self._lock = self._transcript = None
        self._inboxes = ()

    def _over(self, wire: Wire) -> can.BusABC:
        """An slcan bus on a wire: opened on a loop of its own, then given the wire and told to begin."""
        bus = slcanBus("loop://", sleep_after_open=0)
        bus.serialPortOrig.close()
        port = SerialOverWire(wire)
        bus.serialPortOrig = port  # type: ignore[assignment]  # all that slcanBus asks of a port

        def arrived(t_ns: int, data: bytes) -> None:
            port.put(data)
            while port.in_waiting:
                self._read_one(bus, 0.0, lambda: t_ns)

        wire.connect(arrived)
        bus.set_bitrate(self._bitrate)
        return bus

    def _special(self) -> dict[str, Any]:
        """slcan: no pause after opening, and block in read instead of waking a thousand times a second."""
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

    def _read(self, bus: can.BusABC) -> None:
        end: str | None = f"the reader of {self._channel} stopped on an error of this program (see the log)"
        try:
            while not self._closing.is_set():
                self._read_one(bus, READ_TIMEOUT, time.monotonic_ns)
            end = None
        except (can.CanError, OSError) as error:
            end = f"{self._channel} was lost ({error}): check adapter, cable and power, then open it again"
        finally:
            self.error = self.error or end
            for _, inbox in self._inboxes:
                inbox.end()

    def _read_one(self, bus: can.BusABC, timeout: float, now_ns: Callable[[], int]) -> None:
        try:
            message = bus.recv(timeout)
        except (ValueError, IndexError) as error:
            self._bad.add(str(error))
            return
        except can.CanOperationError as error:
            if not isinstance(error.__cause__, UnicodeDecodeError):
                raise
            bus.flush()  # type: ignore[attr-defined]  # only slcan decodes text, and it has flush()
            self._bad.add(str(error.__cause__))  # when it is told, what comes next is read
            return
        if message is None:
            return
        t_ns = now_ns()
        frame = Frame(message.arbitration_id, message.is_extended_id, bytes(message.data))
        if message.is_error_frame or message.is_remote_frame or len(frame.data) != message.dlc:
            self._bad.add(f"{frame} of length {message.dlc}" + (" (error frame)" if message.is_error_frame else ""))
            return
        self._received += 1
        if self._transcript is not None:
            self._transcript.write(t_ns, "<", str(frame).encode())
        for accept, inbox in self._inboxes:
            if accept(frame):
                inbox.put(t_ns, (frame,))


def _shut_down(bus: can.BusABC) -> None:
    """Shut down, and close the port even where python-can's farewell fails on a lost cable and leaves it open."""
    with contextlib.suppress(can.CanError, OSError):
        bus.shutdown()
    port = getattr(bus, "serialPortOrig", None)
    if port is not None:
        with contextlib.suppress(OSError):
            port.close()
