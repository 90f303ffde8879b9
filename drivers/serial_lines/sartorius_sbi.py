"""Force from a Sartorius balance or weigh cell that speaks SBI: asked for its reading, one question at a time.

An answer does not say which question it answers: after one that is late nothing is asked until it would have come.
"""

from __future__ import annotations

import contextlib
import json
import math
from dataclasses import dataclass
from typing import Literal

from drivers.acquisition import Acquisition
from drivers.errors import DeviceError, LinkError
from drivers.force_units import NEWTONS_PER_UNIT
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import (
    LineCutter,
    check_line_rate,
    line_time,
    printable,
)
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream
from drivers.serial_lines.sartorius_lines import (
    ANSWER_CHARACTERS,
    MODEL,
    PRINT,
    SERIAL,
    VERSION,
    Fault,
    Weight,
    decode,
    encode,
)

ROW_CHARACTERS = len(encode(PRINT)) + ANSWER_CHARACTERS
PATIENCE = 2.0
"""Timeouts after which an answer does not come any more, and the next may be asked for."""
EARLY = 0.25
"""Of a period: a turn that comes by so much too early is one in time."""


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind sartorius_sbi."""

    port: str
    rate: float
    """Times a second that it is asked; one a turn of the control loop at most. A balance has 5 to 20 new readings/s."""
    unit: str | None = None
    """That it shows; None: as it says, which it does only while it is stable."""
    baud: int = 9600
    framing: str = "8O1"
    sign: Literal[1, -1] = 1
    """+1: the balance's positive direction is forward thrust."""
    resolution: float | None = None
    """N, one digit of the display."""
    range_min: float | None = None
    """N"""
    range_max: float | None = None
    """N"""
    timeout: float = 1.0
    """s for an answer."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        check_line_rate("sartorius_sbi", self.rate, self.baud, self.framing, ROW_CHARACTERS)
        if self.unit is not None and self.unit not in NEWTONS_PER_UNIT:
            raise ValueError(f"sartorius_sbi unit must be one of {', '.join(NEWTONS_PER_UNIT)}, not {self.unit!r}")
        if self.sign not in (1, -1):
            raise ValueError(f"sartorius_sbi sign must be 1 or -1, not {self.sign}")
        self.check_acquisition("sartorius_sbi")
        if not 0.0 < self.timeout <= 10.0:
            raise ValueError(f"sartorius_sbi timeout must be between 0 and 10 s, not {self.timeout}")


class SartoriusSbi:
    """A force sensor: stream `<name>` with `thrust` [N] and `stable` (1 or 0)."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._port: SerialPort[bytes] = SerialPort(name, settings, LineCutter().feed, wire)
        self._reset()

    def _reset(self) -> None:
        self._bad, self._fault, self._unit = BadRecords(), "", self._options.unit or ""
        self._polling = self._waiting = False
        self._asked_ns = self._next_ns = 0

    @property
    def streams(self) -> tuple[Stream, ...]:
        options = self._options
        formula = "thrust = sign * reading * newtons per unit shown (standard gravity 9.80665 m/s^2)"
        calibration = {"formula": formula, "sign": options.sign, "gain_std": options.gain_std}
        on_the_line = line_time(options.baud, options.framing, ANSWER_CHARACTERS)
        thrust = Channel(
            "thrust", "thrust", "N", noise_std=options.noise_std, quantum=options.resolution,
            delay=options.delay + on_the_line, delay_std=options.delay_std, window=options.window,
            low_pass=options.low_pass, filter=options.filter, range_min=options.range_min, range_max=options.range_max,
            calibration=json.dumps(calibration),
        )  # fmt: skip
        stable = Channel("stable", None, "1", description="1: the balance calls the reading stable")
        return (Stream(self.name, "sartorius_sbi", (thrust, stable), 1.0 / options.rate),)

    def open(self) -> str:
        self._reset()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._require_reading()
            model, serial, version = (self._text(command) for command in (MODEL, SERIAL, VERSION))
            self._next_ns, self._polling = self._port.now_ns(), True
            undo.pop_all()
        return f"Sartorius {model}, version {version}, serial number {serial}"

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, line in self._port.inbox.take_all():
            late = not self._waiting or t_ns - self._asked_ns > 1e9 * self._options.timeout
            self._waiting = False
            record = decode(line)
            if isinstance(record, Weight) and not late and record.unit in (self._unit, ""):
                samples.append(Sample(self.name, t_ns, (self._thrust(record), float(record.unit != ""))))
                self._fault = ""
            else:
                self._note(record, line)
        self._poll()
        return samples

    def health(self) -> LinkHealth:
        inbox, error = self._port.inbox, self._fault or self._port.error
        alive = self._port.alive and not error
        return LinkHealth(alive, inbox.received, self._bad.count, self._bad.first, error or None, inbox.dropped)

    def tare(self) -> None:
        """Raises DeviceError: a balance tares when it is stable, which water never lets it be."""
        raise DeviceError(f"{self.name}: a balance waits for stability before it tares: tare by subtraction")

    def close(self) -> None:
        self._polling = False
        self._port.close()

    def _thrust(self, weight: Weight) -> float:
        return self._options.sign * weight.value * NEWTONS_PER_UNIT[self._unit]

    def _note(self, record: object, line: bytes) -> None:
        """What is no sample: counted, and where it makes every later value doubtful, a fault until a good one comes."""
        self._bad.add(printable(line))
        if isinstance(record, Fault):
            self._fault = f"{self.name} reports {record.text}: look at its display and its manual"
        elif isinstance(record, Weight) and record.unit not in (self._unit, ""):
            self._fault = f"{self.name} changed its unit from {self._unit} to {record.unit}: set it back"

    # -- at opening --------------------------------------------------------------------------------------------------

    def _line(self, command: str) -> bytes | None:
        """Asked twice: the first answer may meet the rest of an old conversation."""
        for _ in range(2):
            self._port.inbox.take_all()
            found = self._port.ask(encode(command), lambda _line: True, self._options.timeout)
            if found is not None:
                return found
        return None

    def _require_reading(self) -> None:
        o, line = self._options, self._line(PRINT)
        record = None if line is None else decode(line)
        if not isinstance(record, Weight):
            raise DeviceError(
                f"{self.name}: no balance with SBI answers on {o.port} at {o.baud} baud {o.framing} (ESC P expected a"
                f" reading, came {'nothing' if line is None else printable(line)!r}): check port, baud, framing, that"
                " its interface is set to SBI and its print parameter to 'without stability'"
            )
        if math.isnan(record.value):
            raise DeviceError(f"{self.name} is out of its range: look at what is on it")
        if record.unit and o.unit and record.unit != o.unit:
            raise DeviceError(f"{self.name} shows {record.unit}, the bench file says {o.unit}: change one of them")
        self._unit = record.unit or o.unit or ""
        if self._unit not in NEWTONS_PER_UNIT:
            raise DeviceError(
                f"{self.name} says its unit only while it is stable, and said {self._unit or 'none'}: give unit, one of"
                f" {', '.join(NEWTONS_PER_UNIT)}, in the bench file"
            )

    def _text(self, command: str) -> str:
        line = self._line(command)
        return "unknown" if line is None else printable(line).strip()

    # -- polling -----------------------------------------------------------------------------------------------------

    def _poll(self) -> None:
        """Ask when it is time and nothing else is asked, or its answer would have come."""
        if not self._polling or not self._port.alive:
            return
        now_ns, period_ns = self._port.now_ns(), round(1e9 / self._options.rate)
        if self._waiting and now_ns - self._asked_ns < PATIENCE * 1e9 * self._options.timeout:
            return
        if now_ns < self._next_ns - EARLY * period_ns:
            return
        if self._waiting:
            self._bad.add("no answer to ESC P")
        self._next_ns = max(self._next_ns + period_ns, now_ns - period_ns)
        self._waiting, self._asked_ns = True, now_ns
        with contextlib.suppress(LinkError):  # health says why the port is gone
            self._port.write(encode(PRINT))
