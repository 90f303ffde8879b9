"""Flow speed from a Nortek acoustic velocimeter that sends NMEA sentences `$PNORC1` (data format 101).

Source: Nortek, Signature Integrator's Guide (2017), pages 68-77: `$PNORC1,date,time,cell,position,v1,v2,v3,...*hh`, one
sentence per cell; velocities in m/s, component 1 is beam 1, X or East by the set coordinate system; page 69: variants
of -9 (-9.00, -999 ...) are invalid data, empty fields are not used, the checksum is the XOR of what is between $ and *.
"""

from __future__ import annotations

import contextlib
import math
import re
from dataclasses import dataclass
from functools import reduce
from operator import xor
from typing import Literal, NamedTuple

from drivers.errors import DeviceError
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import LineCutter, check_line_rate, printable
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream

LINE_CHARACTERS = 92
"""A `$PNORC1` of a four-beam instrument with CR LF."""

_SENTENCE = re.compile(rb"\$([^$*]*)\*([0-9A-Fa-f]{2})")
_VELOCITY = re.compile(rb"[+-]?\d{1,20}(?:\.\d{0,20})?")
"""Bounded: 310 digits would be an infinite speed."""
_INVALID = re.compile(rb"-9+(?:\.[09]*)?")


class Velocity(NamedTuple):
    """The velocity in one cell of the profile."""

    cell: int
    components: tuple[float, float, float]
    """m/s, NaN where the instrument says invalid or nothing."""


class OtherSentence(NamedTuple):
    """Well formed, but no velocity."""

    identifier: str


class Unreadable(NamedTuple):
    """A line that is no sentence, or whose checksum is wrong."""

    line: bytes


Record = Velocity | OtherSentence | Unreadable


def checksum(body: bytes) -> int:
    """XOR of the characters between $ and *."""
    return reduce(xor, body, 0)


def encode(body: str) -> bytes:
    """A sentence with $, checksum, CR LF."""
    return f"${body}*{checksum(body.encode('ascii')):02X}\r\n".encode("ascii")


def decode(line: bytes) -> Record:
    """One line without CR LF; a wrong checksum makes it unreadable."""
    parts = _SENTENCE.fullmatch(line.strip())
    if parts is None or checksum(parts[1]) != int(parts[2], 16):
        return Unreadable(line)
    fields = parts[1].split(b",")
    if fields[0] != b"PNORC1":
        return OtherSentence(printable(fields[0]))
    components = [_velocity(field) for field in fields[5:8]]
    if len(components) < 3 or not fields[3].isdigit():
        return Unreadable(line)
    first, second, third = components
    if first is None or second is None or third is None:
        return Unreadable(line)
    return Velocity(int(fields[3]), (first, second, third))


def _velocity(field: bytes) -> float | None:
    if not field or _INVALID.fullmatch(field):
        return math.nan
    return float(field) if _VELOCITY.fullmatch(field) else None


class Decoder:
    """Bytes in any portions -> records."""

    def __init__(self) -> None:
        self._lines = LineCutter()

    def feed(self, data: bytes) -> list[Record]:
        return [decode(line) for line in self._lines.feed(data)]


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind nortek_nmea."""

    port: str
    rate: float
    """Measurements/s, as set in the instrument."""
    baud: int = 9600
    framing: str = "8N1"
    component: Literal[1, 2, 3] = 1
    """Which velocity component lies along the thruster's axis."""
    sign: Literal[1, -1] = 1
    """+1: the component is positive when the water comes at the thruster from ahead."""
    cell: int = 1
    """Which measurement cell."""
    cells: int = 1
    """How many cells the instrument sends per measurement (one line each)."""
    noise_std: float | None = None
    """m/s, known noise of one value (1 sigma)."""
    timeout: float = 3.0
    """s for the first velocity after opening."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        if self.cells < 1 or not 1 <= self.cell <= self.cells:
            raise ValueError(f"nortek_nmea cell must be 1 to cells ({self.cells}), not {self.cell}")
        check_line_rate("nortek_nmea", self.rate, self.baud, self.framing, LINE_CHARACTERS * self.cells)
        if self.component not in (1, 2, 3) or self.sign not in (1, -1):
            raise ValueError("nortek_nmea component must be 1, 2 or 3 and sign 1 or -1")
        if self.timeout <= 1.0 / self.rate:
            raise ValueError(f"nortek_nmea timeout {self.timeout:g} s is shorter than one measurement at this rate")


class NortekNmea:
    """A speed sensor: stream `<name>` with `flow_speed` [m/s]."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._bad = BadRecords()
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._port = SerialPort(name, settings, Decoder().feed, wire)

    @property
    def streams(self) -> tuple[Stream, ...]:
        options = self._options
        description = f"component {options.component} x {options.sign}, cell {options.cell}"
        flow = Channel("flow_speed", "flow_speed", "m/s", noise_std=options.noise_std, description=description)
        return (Stream(self.name, "nortek_nmea", (flow,), 1.0 / options.rate),)

    def open(self) -> str:
        """The instrument measures by itself; nothing is sent to it."""
        self._bad = BadRecords()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._require_velocity()
            undo.pop_all()
        return f"Nortek velocimeter, cell {self._options.cell} (it does not send its serial number)"

    def drain(self) -> list[Sample]:
        options, samples = self._options, []
        for t_ns, record in self._port.inbox.take_all():
            if isinstance(record, Velocity) and record.cell == options.cell:
                speed = options.sign * record.components[options.component - 1]
                samples.append(Sample(self.name, t_ns, (speed,)))
            elif isinstance(record, Unreadable):
                self._bad.add(printable(record.line))
        return samples

    def health(self) -> LinkHealth:
        port, bad = self._port, self._bad
        return LinkHealth(port.alive, port.inbox.received, bad.count, bad.first, port.error, port.inbox.dropped)

    def close(self) -> None:
        self._port.close()

    def _require_velocity(self) -> None:
        cell, seconds = self._options.cell, self._options.timeout
        first = self._port.inbox.wait_for(lambda r: isinstance(r, Velocity) and r.cell == cell, seconds, take=False)
        if first is None:
            raise DeviceError(
                f"{self.name}: no valid $PNORC1 of cell {cell} on {self._options.port} within {seconds:g} s"
                f" ({self._port.inbox.received} other lines): set data format 101, baud and cell, and start measuring"
            )
