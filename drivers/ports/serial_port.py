"""A serial port: what arrives is stamped and decoded. With can_bus.py the only place that opens wires."""

from __future__ import annotations

import contextlib
import os
import select
import termios
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

import serial

from drivers.errors import LinkError
from drivers.ports.arrivals import Arrivals, Chunk
from drivers.ports.inbox import Inbox
from drivers.ports.lines import bits_per_character
from drivers.ports.own_reader import OwnReader
from drivers.ports.reader import READ_TIMEOUT, READER, Lost, Port
from drivers.ports.refusals import why_not_open
from drivers.ports.transcript import Transcript
from drivers.ports.wire import Arrived, Wire

Record = TypeVar("Record")

WRITE_TIMEOUT = 0.2
"""s; a port that takes no bytes for this long has lost its device, or a CAN adapter its bus or its cable: well below
the lateness that the loop allows."""


@dataclass(frozen=True, slots=True)
class SerialSettings:
    """How to open a port. `port` is a device path or any URL pyserial knows (`socket://...`, `rfc2217://...`)."""

    port: str
    baud: int
    framing: str = "8N1"
    capture: str = ""
    """File that gets every byte with its time; empty: none."""
    capacity: int = 100_000
    """Records kept between two drains; more than a minute of a 1 kHz instrument."""

    def __post_init__(self) -> None:
        if not self.port:
            raise ValueError("port is empty: give a device path such as /dev/ttyUSB0")
        bits_per_character(self.framing)


class SerialPort(Generic[Record]):
    """Bytes go through `feed` (pure: bytes -> records) and wait in a bounded inbox with their arrival time."""

    def __init__(
        self,
        name: str,
        settings: SerialSettings,
        feed: Callable[[bytes], Sequence[Record]],
        wire: Wire | None = None,
        *,
        at_once: bool = False,
    ) -> None:
        """`wire`: used instead of the port that `settings` names, with its stamps and in its time.

        `at_once`: `feed` hears what comes when it comes, in the reader's thread, as where it asks on by what it hears.
        """
        self._at_once = at_once
        self.settings = settings
        self._wire = wire
        self.error: str | None = None
        self._name = name
        self._feed = feed
        self._arrivals, self.inbox = self._empty()
        self._serial: serial.Serial | None = None
        self._transcript: Transcript | None = None
        self._stop_reading: Callable[[], None] | None = None
        """Ends the reading."""
        self._opened = False

    @property
    def alive(self) -> bool:
        return self._opened and self.error is None

    def open(self) -> None:
        """Open exclusively and start reading. Raises LinkError."""
        if self._opened:
            raise LinkError(f"{self._name}: {self.settings.port} is already open")
        self.error = None
        self._arrivals, self.inbox = self._empty()
        if self._wire is not None:
            self._transcript = self._new_transcript()
            self._wire.connect(self._arrived)
            self._opened = True
            return
        try:
            port = _open_serial(self.settings)
        except (OSError, ValueError) as error:
            why = why_not_open(error)
            raise LinkError(f"{self._name}: cannot open {self.settings.port}: {why}") from error
        try:
            self._transcript = self._new_transcript()
        except LinkError:
            port.close()
            raise
        self._serial = port
        self._stop_reading = read(port, self.settings.port, self._arrived, self._lost)
        self._opened = True

    def _empty(self) -> tuple[Arrivals, Inbox[Record]]:
        """Bytes that came go through `feed` into the inbox."""

        def decode(chunks: list[Chunk]) -> None:
            if rows := [(t_ns, record) for t_ns, data in chunks for record in self._feed(data)]:
                inbox.put(rows)

        def failed() -> None:
            why = f"the decoder of {self.settings.port} stopped on an error of this program (see the log)"
            self.error = self.error or why
            inbox.end()

        arrivals = Arrivals(decode, failed)
        inbox: Inbox[Record] = Inbox(self.settings.capacity, self._wire, arrivals)
        return arrivals, inbox

    def _new_transcript(self) -> Transcript | None:
        if not self.settings.capture:
            return None
        try:
            return Transcript(Path(self.settings.capture))
        except OSError as error:
            raise LinkError(f"{self._name}: cannot write the transcript: {error}") from error

    def write(self, data: bytes) -> None:
        """Send bytes. Raises LinkError when the port is closed, lost, or takes nothing for 0.2 s."""
        if (self._wire is None and self._serial is None) or not self.alive:
            raise LinkError(f"{self._name}: {self.error or f'{self.settings.port} is not open'}")
        sent_ns = self.now_ns()  # before: the answer may be in the transcript first, and must not have the older stamp
        try:
            if self._wire is not None:
                self._wire.write(data)
            elif self._serial is not None:
                write(self._serial, data)
        except OSError as error:
            self.error = f"{self.settings.port} refused {len(data)} bytes ({error}): check adapter, cable and power"
            raise LinkError(f"{self._name}: {self.error}") from error
        if self._transcript is not None:
            self._transcript.write(sent_ns, ">", data)

    def retune(self, baud: int, framing: str) -> None:
        """Another rate from now on, the port stays open. Raises LinkError where it is not, or cannot do that rate.

        A wire that was given has no rate.
        """
        bits_per_character(framing)
        self.settings = replace(self.settings, baud=baud, framing=framing)
        if self._wire is not None:
            return
        if self._serial is None:
            raise LinkError(f"{self._name}: {self.settings.port} is not open")
        try:
            self._serial.apply_settings(
                {
                    "baudrate": baud, "bytesize": int(framing[0]), "parity": framing[1], "stopbits": int(framing[2]),
                }
            )  # fmt: skip
        except (OSError, ValueError, termios.error) as error:
            raise LinkError(f"{self._name}: {self.settings.port} cannot do {baud} baud {framing}: {error}") from error

    def now_ns(self) -> int:
        """Time of the stamps, ns: the machine's monotonic clock, or the wire's."""
        return time.monotonic_ns() if self._wire is None else round(self._wire.now() * 1e9)

    def ask(self, request: bytes, match: Callable[[Record], bool], timeout: float) -> Record | None:
        """Send `request`, wait up to `timeout` s for the first record that matches. Others stay in the inbox.

        None when nothing matching came. Raises LinkError when the wire fails.
        """
        self.write(request)
        record = self.inbox.wait_for(match, timeout)
        if record is None and self.error is not None:
            raise LinkError(f"{self._name}: {self.error}")
        return record

    def close(self) -> None:
        """Stop the reader and let the port go. Safe to call twice and after a failure."""
        if self._wire is not None:
            self._wire.disconnect()
        if self._stop_reading is not None:
            self._stop_reading()
        if self._serial is not None:
            with contextlib.suppress(OSError):
                self._serial.close()
        if self._transcript is not None:
            self._transcript.close()
        self._stop_reading = self._serial = self._transcript = None
        self._opened = False

    def _lost(self, why: str) -> None:
        self.error = self.error or why
        self._arrivals.decode()
        self.inbox.end()

    def _arrived(self, t_ns: int, data: bytes) -> None:
        if self._transcript is not None:
            self._transcript.write(t_ns, "<", data)
        self._arrivals.add(t_ns, data)
        if self._at_once:
            self._arrivals.decode()


def read(port: serial.Serial, label: str, arrived: Arrived, lost: Lost) -> Callable[[], None]:
    """From now on tell `arrived` what comes. Returns what ends that: after it nobody is told any more.

    pyserial's own read takes four system calls and half as much again in Python: the descriptor is read, if it has one.
    """
    descriptor = descriptor_of(port)
    if descriptor is None:
        return OwnReader(label, lambda: _look(port, arrived), lost, (OSError,)).end
    READER.watch(descriptor, Port(label, arrived, lost))
    return lambda: READER.forget(descriptor)


def descriptor_of(port: serial.Serial) -> int | None:
    """loop:// and rfc2217:// have none."""
    try:
        return port.fileno()
    except (OSError, NotImplementedError, AttributeError):
        return None


def write(port: serial.Serial, data: bytes) -> None:
    """All of `data`. Raises OSError where the port takes nothing more for WRITE_TIMEOUT.

    pyserial's own raises too where every byte went out at once, if this process was kept waiting meanwhile by others.
    """
    descriptor = descriptor_of(port)
    if descriptor is None:
        port.write(data)
        return
    deadline = time.monotonic() + WRITE_TIMEOUT
    while data:
        _, ready, _ = select.select([], [descriptor], [], max(deadline - time.monotonic(), 0.0))
        if not ready:
            raise TimeoutError(f"it took nothing more for {WRITE_TIMEOUT:g} s, {len(data)} bytes are left")
        with contextlib.suppress(BlockingIOError):
            data = data[os.write(descriptor, data) :]


def _look(port: serial.Serial, arrived: Arrived) -> None:
    if data := port.read(port.in_waiting or 1):
        arrived(time.monotonic_ns(), data)


def _open_serial(settings: SerialSettings) -> serial.Serial:
    port = serial.serial_for_url(
        settings.port,
        baudrate=settings.baud,
        bytesize=int(settings.framing[0]),
        parity=settings.framing[1],
        stopbits=int(settings.framing[2]),
        timeout=READ_TIMEOUT,
        write_timeout=WRITE_TIMEOUT,
        exclusive=True,
    )
    set_low_latency(port)
    return port


def set_low_latency(port: serial.Serial) -> None:
    """1 ms instead of the 16 ms of FTDI adapters; a pty and most URLs have no such mode."""
    with contextlib.suppress(OSError, ValueError, NotImplementedError, AttributeError):
        port.set_low_latency_mode(True)
