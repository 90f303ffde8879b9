"""Force from a Mantracourt digital strain gauge card (DSC, DCell, DLC, DSCUSB) by its ASCII protocol.

Each turn asks for STAT; where that says that there is a value which was not read yet, SYS is asked for at once. So each
conversion is a row once, and a card that stands still gives none. Answers have no name: there is one question at a
time, and after one without an answer nothing is asked for as long again.
"""

from __future__ import annotations

import contextlib
import json
import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from drivers.acquisition import Acquisition
from drivers.errors import DeviceError, LinkError
from drivers.force_units import NEWTONS_PER_UNIT
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import (
    check_line_rate,
    line_time,
    printable,
)
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream
from drivers.serial_lines.mantracourt_lines import (
    ANSWER_TIME,
    BROKEN,
    NO_VALUE,
    OLD,
    Decoder,
    Number,
    Record,
    Unreadable,
    question,
    told,
)

ANSWER_CHARACTERS = 12
"""Sign, DPB digits, point, DP digits, CR as delivered; 5 before the point and 3 to 5 after it."""
ROW_CHARACTERS = len("!001:STAT?\r!001:SYS?\r") + 2 * ANSWER_CHARACTERS
DIGITS = 5
EARLY = 0.25
"""Of a period: a turn that comes by so much too early is one in time."""


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind mantracourt_dsc."""

    port: str
    rate: float
    """Times a second that the card is asked; one a turn of the control loop at most."""
    unit: str
    """That SYS is calibrated in: the card does not say it."""
    station: int = 1
    """STN; a DSCUSB is always 1."""
    baud: int = 115_200
    framing: str = "8N1"
    sign: Literal[1, -1] = 1
    """+1: the cell's positive direction is forward thrust."""
    resolution: float | None = None
    """N, one digit of SYS (DP digits after its point)."""
    range_min: float | None = None
    """N"""
    range_max: float | None = None
    """N"""
    timeout: float = 0.1
    """s for an answer; the manual says 0.05."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        check_line_rate("mantracourt_dsc", self.rate, self.baud, self.framing, ROW_CHARACTERS)
        if self.unit not in NEWTONS_PER_UNIT:
            raise ValueError(f"mantracourt_dsc unit must be one of {', '.join(NEWTONS_PER_UNIT)}, not {self.unit!r}")
        if not 1 <= self.station <= 999:
            raise ValueError(f"mantracourt_dsc station must be 1 to 999, not {self.station}")
        if self.sign not in (1, -1):
            raise ValueError(f"mantracourt_dsc sign must be 1 or -1, not {self.sign}")
        self.check_acquisition("mantracourt_dsc")
        if not ANSWER_TIME <= self.timeout <= 10.0:
            raise ValueError(f"mantracourt_dsc timeout must be between {ANSWER_TIME} and 10 s, not {self.timeout}")


class Row(NamedTuple):
    """A value and the status that was asked for before it."""

    status: int
    value: float


class MantracourtDsc:
    """A force sensor: stream `<name>` with `thrust` [N] and `status`."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._decoder = Decoder()
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._port: SerialPort[Record | Row] = SerialPort(name, settings, self._feed, wire, at_once=True)
        self._turn = threading.Lock()
        self._reset()

    def _reset(self) -> None:
        self._bad, self._fault = BadRecords(), ""
        self._polling = False
        self._asked = ""
        """The question that waits for its answer; empty: none."""
        self._asked_ns = self._next_ns = 0
        self._status = 0

    @property
    def streams(self) -> tuple[Stream, ...]:
        options = self._options
        calibration = {
            "formula": "thrust = sign * SYS * newtons per unit (standard gravity 9.80665 m/s^2)",
            "sign": options.sign, "unit": options.unit, "gain_std": options.gain_std,
        }  # fmt: skip
        on_the_line = line_time(options.baud, options.framing, ANSWER_CHARACTERS)
        thrust = Channel(
            "thrust", "thrust", "N", noise_std=options.noise_std, quantum=options.resolution,
            delay=options.delay + on_the_line, delay_std=options.delay_std, window=options.window,
            low_pass=options.low_pass, filter=options.filter, range_min=options.range_min, range_max=options.range_max,
            calibration=json.dumps(calibration),
        )  # fmt: skip
        status = Channel("status", None, "1", integer=True, description="STAT as sent")
        return (Stream(self.name, "mantracourt_dsc", (thrust, status), 1.0 / options.rate),)

    def open(self) -> str:
        self._reset()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._require_digits()
            version, low, high = (int(self._number(name)) for name in ("VER", "SERL", "SERH"))
            self._refuse_trouble(int(self._number("STAT")))
            self._number("SYS")
            self._next_ns, self._polling = self._port.now_ns(), True
            undo.pop_all()
        return f"Mantracourt DSC {version // 256}.{version % 256:02d}, serial number {high * 65536 + low}"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, record in self._port.inbox.take_all():
            if isinstance(record, Row):
                if self._is_whole(record.status):
                    samples.append(Sample(self.name, t_ns, (self._thrust(record), float(record.status))))
            elif isinstance(record, Unreadable):
                self._bad.add(printable(record.line))
            else:
                self._bad.add(str(record))
        self._poll()
        return samples

    def health(self) -> LinkHealth:
        inbox, error = self._port.inbox, self._fault or self._port.error
        alive = self._port.alive and not error
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, error or None, inbox.dropped)

    def tare(self) -> None:
        """Raises DeviceError: the card's zero (SZ) is in a memory that wears out."""
        raise DeviceError(f"{self.name}: a Mantracourt card is not tared over the wire: tare by subtraction")

    def close(self) -> None:
        self._polling = False
        self._port.close()

    def _is_whole(self, status: int) -> bool:
        """A broken cell is a fault of the link, and gives no row, until it is gone."""
        broken = told(status, BROKEN)
        self._fault = f"{self.name} reports {broken}: look at the cell and its cable, then open again" if broken else ""
        return not broken

    def _thrust(self, row: Row) -> float:
        """N; NaN where the status says that there is none."""
        if told(row.status, NO_VALUE):
            return math.nan
        return self._options.sign * row.value * NEWTONS_PER_UNIT[self._options.unit]

    # -- at opening --------------------------------------------------------------------------------------------------

    def _number(self, name: str) -> float:
        """Asked twice: the first answer may meet the rest of an old conversation."""
        o = self._options
        record: Record | Row | None = None
        for _ in range(2):
            self._port.inbox.take_all()
            record = self._port.ask(question(o.station, name), lambda r: not isinstance(r, Row), o.timeout)
            if isinstance(record, Number):
                return record.value
        raise DeviceError(
            f"{self.name}: no Mantracourt card answers as station {o.station} on {o.port} at {o.baud} baud {o.framing}"
            f" ('{name}?' expected a number, came {_shown(record)}): check port, station, baud, and that it is the"
            " ASCII version"
        )

    def _require_digits(self) -> None:
        """STAT and serial numbers have five digits; with fewer before the point (DPB) they are cut."""
        if (digits := self._number("DPB")) < DIGITS:
            raise DeviceError(
                f"{self.name} sends {digits:g} digits before the point (DPB), and its status has {DIGITS}: set DPB to"
                f" {DIGITS} or more"
            )

    def _refuse_trouble(self, status: int) -> None:
        if trouble := told(status, BROKEN | NO_VALUE):
            raise DeviceError(f"{self.name} reports {trouble} (STAT {status}): look at the cell and its cable")

    # -- polling -----------------------------------------------------------------------------------------------------

    def _poll(self) -> None:
        """Ask for STAT when it is time and nothing else is asked."""
        if not self._polling or not self._port.alive:
            return
        now_ns, period_ns = self._port.now_ns(), round(1e9 / self._options.rate)
        patience_ns = round(2e9 * self._options.timeout)
        with self._turn:
            if self._asked and now_ns - self._asked_ns < patience_ns:
                return
            if now_ns < self._next_ns - EARLY * period_ns:
                return
            if self._asked:
                self._bad.add(f"no answer to {self._asked}?")
            self._next_ns = max(self._next_ns + period_ns, now_ns - period_ns)
            self._ask("STAT", now_ns)

    def _ask(self, name: str, now_ns: int) -> None:
        self._asked, self._asked_ns = name, now_ns
        with contextlib.suppress(LinkError):  # health says why the port is gone
            self._port.write(question(self._options.station, name))

    def _feed(self, data: bytes) -> Sequence[Record | Row]:
        """An answer to STAT that promises a new value is followed by the question for it, in the reader's thread."""
        records: list[Record | Row] = []
        for record in self._decoder.feed(data):
            with self._turn:
                asked, self._asked = self._asked, ""
                now_ns = self._port.now_ns()
                if not self._polling or not asked or not isinstance(record, Number):
                    records.append(record)
                elif now_ns - self._asked_ns > 1e9 * self._options.timeout:
                    records.append(Unreadable(b"an answer that came too late"))
                elif asked == "SYS":
                    records.append(Row(self._status, record.value))
                else:
                    self._status = int(record.value)
                    if not self._status & OLD:
                        self._ask("SYS", now_ns)
        return records


def _shown(record: Record | Row | None) -> str:
    return "nothing" if record is None else repr(record)
