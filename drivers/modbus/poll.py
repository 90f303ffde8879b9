"""The same requests to a Modbus device, again and again: on time, one at a time, with silence between two frames.

On a port of its own a thread does that; over a wire whose time belongs to somebody else, whoever takes the replies.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from collections.abc import Sequence

from drivers.errors import DeviceError, LinkError
from drivers.modbus.rtu import Decoder, Read, Record, Refusal, Registers, Unreadable, gap
from drivers.ports.lines import bits_per_character
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire

TRIES = 2
"""The first answer may meet the rest of an old conversation."""
JOIN_MARGIN = 2.0
"""s that the polling thread gets to stop."""


class ModbusPoll:
    """`ask` while nothing is polled, then `start`; `take` gives what came, with its arrival."""

    def __init__(self, name: str, settings: SerialSettings, timeout: float, wire: Wire | None = None) -> None:
        """`timeout`: s for a reply."""
        self._name, self._settings, self._timeout, self._wire = name, settings, timeout, wire
        self._gap = gap(settings.baud, bits_per_character(settings.framing))
        self._decoder = Decoder()
        self._turn = threading.Lock()
        self._port: SerialPort[Record] = SerialPort(name, settings, self._feed, wire, at_once=True)
        self._unanswered: deque[tuple[int, Record]] = deque(maxlen=1000)
        self._requests: tuple[Read, ...] = ()
        self._at = 0
        self._period = self._due = self._sent = self._heard = self._quiet = 0.0
        self._waiting = self._refused = False
        self._wake, self._closing = threading.Event(), threading.Event()
        self._poller: threading.Thread | None = None

    @property
    def alive(self) -> bool:
        return self._port.alive

    @property
    def error(self) -> str | None:
        return self._port.error

    @property
    def received(self) -> int:
        return self._port.inbox.received

    @property
    def dropped(self) -> int:
        return self._port.inbox.dropped

    def open(self) -> None:
        """Raises LinkError."""
        self.close()
        self._closing.clear()
        self._unanswered.clear()
        self._requests, self._at, self._waiting = (), 0, False
        self._port.open()

    def ask(self, request: Read) -> Registers:
        """The registers; twice tried. Raises LinkError, and DeviceError with what came instead."""
        why = ""
        for _ in range(TRIES):
            self._pause()
            with self._turn:
                self._decoder.expect(request)
            record = self._port.ask(request.encode(), _is_answer, self._timeout)
            with self._turn:
                why = self._decoder.unanswered() if record is None else str(record)
                self._decoder.expect(None)
            if isinstance(record, Registers):
                return record
            if isinstance(record, Refusal):
                break
        registers = f"registers {request.register} to {request.register + request.count - 1}"
        raise DeviceError(
            f"{self._name}: address {request.address} on {self._settings.port}, {self._settings.baud} baud"
            f" {self._settings.framing}, asked by function {request.function} for {registers}: {why}"
        )

    def start(self, requests: Sequence[Read], rate: float) -> None:
        """Ask all `requests`, one after the other, `rate` times a second; after a failure from the first again."""
        self._port.inbox.take_all()
        self._requests, self._period = tuple(requests), 1.0 / rate
        self._due = self._now()
        self._quiet = self._due + self._gap
        if self._wire is None:
            self._poller = threading.Thread(target=self._poll, name=f"poll {self._name}", daemon=False)
            self._poller.start()

    def take(self) -> Sequence[tuple[int, Record]]:
        """(ns of arrival, record) of all that came, an Unreadable for each request without a reply. Never blocks."""
        rows = self._port.inbox.take_all()
        if self._wire is not None and self._requests and self._port.alive:
            with contextlib.suppress(LinkError):  # told by `error`
                self._step(self._now())
        while self._unanswered:
            rows.append(self._unanswered.popleft())
        return rows

    def close(self) -> None:
        self._closing.set()
        self._wake.set()
        if self._poller is not None:
            self._poller.join(JOIN_MARGIN)
        self._poller, self._requests = None, ()
        self._port.close()

    def _now(self) -> float:
        return time.monotonic() if self._wire is None else self._wire.now()

    def _pause(self) -> None:
        """The silence before a frame."""
        if self._wire is None:
            self._closing.wait(self._gap)
        else:
            self._wire.wait(self._gap)

    def _feed(self, data: bytes) -> list[Record]:
        with self._turn:
            records = self._decoder.feed(data)
        if records:
            self._heard, self._refused = self._now(), not isinstance(records[-1], Registers)
            self._wake.set()
        return records

    def _poll(self) -> None:
        end: str | None = f"the poller of {self._settings.port} stopped on an error of this program (see the log)"
        try:
            while not self._closing.is_set():
                self._wake.clear()
                due = self._step(self._now())
                self._wake.wait(max(0.0, due - self._now()))
            end = None
        except LinkError:
            end = None  # the port says why
        finally:
            self._port.error = self._port.error or end

    def _step(self, now: float) -> float:
        """Note a reply or its absence, send when it is time; s, when there is something to do again."""
        if self._waiting:
            with self._turn:
                answered = not self._decoder.waiting
            if answered:
                self._waiting, self._quiet = False, self._heard + self._gap
                self._at = 0 if self._refused else (self._at + 1) % len(self._requests)
            elif now - self._sent < self._timeout:
                return self._sent + self._timeout
            else:
                self._give_up(now)
        due = self._quiet if self._at else max(self._due, self._quiet)
        if now < due:
            return due
        self._send(now)
        return now + self._timeout

    def _give_up(self, now: float) -> None:
        """A reply that comes late must not answer the next request: nothing is asked for as long again."""
        with self._turn:
            why = self._decoder.unanswered()
            self._decoder.expect(None)
        self._unanswered.append((round(now * 1e9), Unreadable(f"{why} within {self._timeout:g} s")))
        self._waiting, self._quiet, self._at = False, now + self._timeout, 0

    def _send(self, now: float) -> None:
        request = self._requests[self._at]
        if self._at == 0:
            self._due = max(self._due + self._period, now)
        with self._turn:
            self._decoder.expect(request)
        self._sent, self._waiting = now, True
        self._port.write(request.encode())


def _is_answer(record: Record) -> bool:
    return isinstance(record, Registers | Refusal)
