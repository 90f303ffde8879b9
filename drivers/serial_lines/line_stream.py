"""Any instrument that sends one value a line: HX711 on an Arduino, tensiometer, load-cell display.

There is no manual behind this one: the bench file describes the line by a regular expression with named groups
`value` (a decimal number) or `raw` (integer counts), optionally both, `unit` (must never change) and `t` (device time).
The recorded value is `scale * reading + offset`, where the reading is `value`, or `raw` when there is no `value`; with
a `threshold` it is 1 where that is above it, and 0.
"""

from __future__ import annotations

import contextlib
import json
import math
import re
from dataclasses import dataclass
from typing import NamedTuple

from drivers.acquisition import Acquisition
from drivers.errors import DeviceError, LinkError
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import (
    LineCutter,
    check_line_rate,
    line_time,
    printable,
)
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import QUARTZ, Channel, LinkHealth, Sample, Stream

GROUPS = frozenset(("value", "raw", "unit", "t"))
MOST_COUNTS = 2**53
"""Whole numbers up to here are exact as the float64 that a sample is; no converter counts further."""


class Reading(NamedTuple):
    """One line's groups; NaN or None for a group that the pattern does not have."""

    value: float
    raw: int | None
    unit: str | None
    t: float


class Unreadable(NamedTuple):
    """A line that the pattern does not match."""

    line: bytes


Record = Reading | Unreadable


class Decoder:
    """Bytes in any portions -> records, by the user's pattern (matched against the whole line)."""

    def __init__(self, pattern: str) -> None:
        self._pattern = re.compile(pattern)
        self._lines = LineCutter()

    def feed(self, data: bytes) -> list[Record]:
        return [self.decode(line) for line in self._lines.feed(data)]

    def decode(self, line: bytes) -> Record:
        found = self._pattern.fullmatch(line.decode("ascii", errors="replace").strip())
        if found is None:
            return Unreadable(line)
        groups = found.groupdict()
        try:
            raw = None if groups.get("raw") is None else int(groups["raw"])
            value = float(groups["value"]) if groups.get("value") is not None else float("nan" if raw is None else raw)
            t = float(groups["t"]) if groups.get("t") is not None else math.nan
        except (ValueError, OverflowError):
            return Unreadable(line)
        believable = math.isfinite(value) and not math.isinf(t) and (raw is None or abs(raw) <= MOST_COUNTS)
        return Reading(value, raw, groups.get("unit"), t) if believable else Unreadable(line)


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind line_stream."""

    port: str
    pattern: str
    r"""Such as `(?P<raw>-?\d+)` or `(?P<value>[-+.\d]+) (?P<unit>\w+)`."""
    rate: float
    """Lines/s that the instrument sends (HX711: 10 or 80 by a pin)."""
    line_characters: int
    """Length of one line with CR LF, for the check against baud."""
    baud: int = 115_200
    framing: str = "8N1"
    quantity: str | None = "thrust"
    """A quantity of the recording format; the channel has its name."""
    unit: str = "N"
    """SI unit of the recorded value."""
    scale: float = 1.0
    """Unit of the recorded value per unit (or count) of the reading."""
    offset: float = 0.0
    """In the unit of the recorded value."""
    threshold: float | None = None
    """Recorded is 1 above it and 0 elsewhere, in the place of the value: an analogue input of a contact."""
    start: str = ""
    """Text sent after opening, with CR LF; empty: nothing."""
    stop: str = ""
    """Text sent before closing."""
    tare: str = ""
    """Text that zeroes the instrument; empty: it cannot."""
    timeout: float = 3.0
    """s for the first line after opening; an Arduino restarts when its port is opened."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        if self.line_characters < 2:
            raise ValueError(f"line_stream line_characters must be at least 2, not {self.line_characters}")
        check_line_rate("line_stream", self.rate, self.baud, self.framing, self.line_characters)
        try:
            groups = set(re.compile(self.pattern).groupindex)
        except re.error as error:
            raise ValueError(f"line_stream pattern is no regular expression: {error}") from error
        if not groups & {"value", "raw"} or not groups <= GROUPS:
            raise ValueError(
                f"line_stream pattern needs a group (?P<value>...) or (?P<raw>...) and knows only {sorted(GROUPS)}"
            )
        self.check_acquisition("line_stream")
        if not math.isfinite(self.scale) or self.scale == 0.0 or not math.isfinite(self.offset):
            raise ValueError(f"line_stream scale must be finite and not 0, offset finite: {self.scale}, {self.offset}")
        if self.threshold is not None and not math.isfinite(self.threshold):
            raise ValueError(f"line_stream threshold must be finite, not {self.threshold}")


class LineStream:
    """Stream `<name>`: the value, then `raw` and `device_time` when the pattern has those groups."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._groups = frozenset(re.compile(options.pattern).groupindex)
        self._bad = BadRecords()
        self._fault: str | None = None
        self._unit: str | None = None
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._port = SerialPort(name, settings, Decoder(options.pattern).feed, wire)

    @property
    def streams(self) -> tuple[Stream, ...]:
        options = self._options
        calibration = {
            "formula": "value = scale * reading + offset", "scale": options.scale, "offset": options.offset,
            "gain_std": options.gain_std,
        } | ({} if options.threshold is None else {"threshold": options.threshold})  # fmt: skip
        on_the_line = line_time(options.baud, options.framing, options.line_characters)
        counted = "raw" in self._groups and "value" not in self._groups and options.threshold is None
        quantum = abs(options.scale) if counted else None
        channels = [
            Channel(
                options.quantity or "value", options.quantity, options.unit, noise_std=options.noise_std,
                quantum=quantum, delay=options.delay + on_the_line, delay_std=options.delay_std,
                window=options.window, low_pass=options.low_pass, filter=options.filter,
                calibration=json.dumps(calibration),
            )
        ]  # fmt: skip
        if "raw" in self._groups:
            channels.append(Channel("raw", None, "1", integer=True, description="counts as sent"))
        if "t" in self._groups:
            channels.append(Channel("device_time", None, "1", description="the instrument's own time, as sent"))
        return (Stream(self.name, "line_stream", tuple(channels), 1.0 / options.rate, QUARTZ),)

    def open(self) -> str:
        self._bad, self._fault, self._unit = BadRecords(), None, None
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._begin()
            undo.pop_all()
        return f"line stream on {self._options.port} (does not identify itself)"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, record in self._port.inbox.take_all():
            if isinstance(record, Unreadable):
                self._bad.add(printable(record.line))
            elif record.unit != self._unit:
                self._bad.add(f"{record.value} {record.unit}")
                self._fault = (
                    f"{self.name} changed its unit from {self._unit} to {record.unit}: set it back, open again"
                )
            else:
                samples.append(Sample(self.name, t_ns, self._values(record)))
        return samples

    def health(self) -> LinkHealth:
        error, inbox = self._fault or self._port.error, self._port.inbox
        alive = self._port.alive and error is None
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, error, inbox.dropped)

    def tare(self) -> None:
        """Send the tare text of the bench file. Raises DeviceError when there is none, LinkError from the wire."""
        if not self._options.tare:
            raise DeviceError(f"{self.name} has no tare command in the bench file: tare by subtraction")
        self._port.write(self._options.tare.encode("ascii") + b"\r\n")

    def close(self) -> None:
        if self._options.stop and self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone, and with it the stream to stop
                self._port.write(self._options.stop.encode("ascii") + b"\r\n")
        self._port.close()

    def _begin(self) -> None:
        if self._options.start:
            self._port.write(self._options.start.encode("ascii") + b"\r\n")
        first = self._port.inbox.wait_for(lambda r: isinstance(r, Reading), self._options.timeout, take=False)
        if not isinstance(first, Reading):
            seen = [
                printable(record.line) for _, record in self._port.inbox.take_all() if isinstance(record, Unreadable)
            ]
            raise DeviceError(
                f"{self.name}: no line on {self._options.port} matches {self._options.pattern!r} within"
                f" {self._options.timeout:g} s; came {seen[:3] or 'nothing'}: check pattern and baud"
            )
        self._unit = first.unit

    def _values(self, reading: Reading) -> tuple[float, ...]:
        value, threshold = self._options.scale * reading.value + self._options.offset, self._options.threshold
        values = [value if threshold is None else float(value > threshold)]
        if "raw" in self._groups:
            values.append(math.nan if reading.raw is None else float(reading.raw))
        if "t" in self._groups:
            values.append(reading.t)
        return tuple(values)
