"""Force from a balance or weigh module that speaks MT-SICS.

The stream is `SIR` (send immediately and repeat) at the rate of `UPD`: dynamic values are valid data, a thruster never
waits for stability. `@` ends it; on the device `@` also clears a tare, so tare anew after opening. Switch off the
device's auto-zero (menu or `M35`), which would follow a slow force.
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
    check_line_rate,
    line_time,
    printable,
)
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import QUARTZ, Channel, LinkHealth, Sample, Stream
from drivers.serial_lines.mt_sics_lines import (
    INTERNAL_FAULTS,
    LINE_CHARACTERS,
    Decoder,
    Fault,
    Record,
    Reply,
    Unreadable,
    Weight,
    encode,
    number,
)

RATE_TOLERANCE = 0.25
"""A module rounds UPD to the nearest rate it can do; a rate read back further off than this is refused."""
GENERAL_ERRORS = ("ES", "ET", "EL")
"""Syntax, transmission, logical error (2.1.3.2)."""


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind mt_sics."""

    port: str
    rate: float
    """Samples/s asked for with UPD."""
    baud: int = 9600
    framing: str = "8N1"
    set_rate: bool = True
    """False: the device has a fixed rate and no UPD; `rate` then says what that rate is."""
    sign: Literal[1, -1] = 1
    """+1: the cell's positive direction is forward thrust."""
    unit: str | None = None
    """Unit the device must be set to; None takes the one it has when opened."""
    resolution: float | None = None
    """N, one digit of the display."""
    range_min: float | None = None
    """N"""
    range_max: float | None = None
    """N"""
    timeout: float = 2.0
    """s for a reply; 1 s was sometimes too short on a real unit."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud, self.framing)
        check_line_rate("mt_sics", self.rate, self.baud, self.framing, LINE_CHARACTERS)
        if self.sign not in (1, -1):
            raise ValueError(f"mt_sics sign must be 1 or -1, not {self.sign}")
        if self.unit is not None and self.unit not in NEWTONS_PER_UNIT:
            raise ValueError(f"mt_sics unit must be one of {', '.join(NEWTONS_PER_UNIT)}, not {self.unit!r}")
        self.check_acquisition("mt_sics")
        if not 0.0 < self.timeout <= 60.0:
            raise ValueError(f"mt_sics timeout must be between 0 and 60 s, not {self.timeout}")


class MtSics:
    """A force sensor: stream `<name>` with `thrust` [N] and `stable` (1 or 0)."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._port = SerialPort(
            name, SerialSettings(options.port, options.baud, options.framing, options.capture), Decoder().feed, wire
        )
        self._bad = BadRecords()
        self._fault: str | None = None
        self._unit = ""
        self._newtons = math.nan

    @property
    def streams(self) -> tuple[Stream, ...]:
        options = self._options
        formula = "thrust = sign * reading * newtons per unit shown (standard gravity 9.80665 m/s^2)"
        calibration = {"formula": formula, "sign": options.sign, "gain_std": options.gain_std}
        on_the_line = line_time(options.baud, options.framing, LINE_CHARACTERS)
        thrust = Channel(
            "thrust", "thrust", "N", noise_std=options.noise_std, quantum=options.resolution,
            delay=options.delay + on_the_line, delay_std=options.delay_std, window=options.window,
            low_pass=options.low_pass, filter=options.filter, range_min=options.range_min, range_max=options.range_max,
            calibration=json.dumps(calibration),
        )  # fmt: skip
        stable = Channel("stable", None, "1", description="1: the balance calls the reading stable")
        return (Stream(self.name, "mt_sics", (thrust, stable), 1.0 / options.rate, QUARTZ),)

    def open(self) -> str:
        self._bad, self._fault, self._unit = BadRecords(), None, ""
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            identity = self._identify()
            self._set_rate()
            self._start()
            undo.pop_all()
        return identity

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, record in self._port.inbox.take_all():
            if isinstance(record, Weight) and record.unit in (self._unit, ""):
                samples.append(Sample(self.name, t_ns, (record.value * self._newtons, float(record.stable))))
            else:
                self._note(record)
        return samples

    def health(self) -> LinkHealth:
        error = self._fault or self._port.error
        inbox = self._port.inbox
        return LinkHealth(
            alive=self._port.alive and error is None,
            received=inbox.received,
            bad=self._bad.count,
            first_bad=self._bad.first,
            error=error,
            dropped=inbox.dropped,
        )

    def tare(self) -> None:
        """Zero inside the instrument at once (`TI`; `T` would wait for stability, which water never gives).

        Call it from the thread that drains. Raises LinkError, or DeviceError when the device refuses.
        """
        reply = self._ask("TI", ("TI",))
        if reply is None or reply.status not in ("S", "D"):
            raise DeviceError(
                f"{self.name}: tare immediately (TI) expected 'TI S ...' or 'TI D ...', came {_shown(reply)}:"
                " unload the cell, or tare by subtraction"
            )

    def close(self) -> None:
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone, and with it the stream that @ would end
                self._port.write(encode("@"))
        self._port.close()

    def _note(self, record: Record) -> None:
        """What is no sample: counted, and where it makes every later value doubtful, a fault."""
        match record:
            case Weight(value, unit, _):
                self._bad.add(f"{value} {unit}")
                self._fault = f"{self.name} changed its unit from {self._unit} to {unit}: set it back, then open again"
            case Fault(code):
                meaning = INTERNAL_FAULTS.get(code, "unknown")
                self._fault = (
                    f"{self.name} reports internal error {code} ({meaning}): see section 2.1.3.3 of its manual"
                )
            case Unreadable(line):
                self._bad.add(printable(line))
            case Reply(command, _, _) if command in GENERAL_ERRORS:
                self._bad.add(command)

    def _identify(self) -> str:
        """`@` ends an old stream and answers with the serial number. Asked twice: the first may meet half a line."""
        reply = self._ask("@", ("I4",)) or self._ask("@", ("I4",))
        if reply is None:
            raise DeviceError(
                f"{self.name}: no MT-SICS device answers on {self._options.port} at {self._options.baud} baud"
                f" {self._options.framing} ('@' expected 'I4 A \"serial\"'): check baud, framing and power"
            )
        model = self._ask("I2", ("I2",))
        described = model.text.strip('" ') if model and model.status == "A" else "unknown model"
        return f"{described}, serial number {reply.text.strip(chr(34))}"

    def _set_rate(self) -> None:
        if not self._options.set_rate:
            return
        asked = f"UPD {self._options.rate:g}"
        reply = self._ask(asked, ("UPD",))
        if reply is None or reply.status != "A":
            raise DeviceError(
                f"{self.name} does not accept '{asked}' (came {_shown(reply)}): ask a rate it has,"
                " or, for a model with a fixed rate, set set_rate = false and rate to that rate"
            )
        actual = self._ask("UPD", ("UPD",))
        if actual is None or actual.status != "A":
            return  # settable, not readable: some models
        self._check_rate(actual.text)

    def _check_rate(self, text: str) -> None:
        rate, actual = self._options.rate, number(text)
        if actual is None or abs(actual / rate - 1.0) > RATE_TOLERANCE:
            raise DeviceError(
                f"{self.name} was set to {rate:g} samples/s but says it sends {text or 'nothing'}:"
                " put a rate that it can do in the bench file"
            )

    def _start(self) -> None:
        self._port.inbox.take_all()
        self._port.write(encode("SIR"))
        first = self._port.inbox.wait_for(_has_unit, self._options.timeout, take=False)
        if not isinstance(first, Weight):
            raise DeviceError(
                f"{self.name} sends no weight after 'SIR' within {self._options.timeout:g} s"
                f" ({self._port.error or 'overloaded, or still starting'}): look at its display"
            )
        wanted = self._options.unit
        if wanted is not None and first.unit != wanted:
            raise DeviceError(f"{self.name} shows {first.unit}, the bench file says {wanted}: change one of them")
        self._unit = first.unit
        self._newtons = self._options.sign * NEWTONS_PER_UNIT[first.unit]

    def _ask(self, command: str, answers: tuple[str, ...]) -> Reply | None:
        """The reply to a command, or the general error `ES`, `EL`, `ET`; None when none came in time."""
        wanted = (*answers, *GENERAL_ERRORS)
        record = self._port.ask(
            encode(command), lambda r: isinstance(r, Reply) and r.command in wanted, self._options.timeout
        )
        return record if isinstance(record, Reply) else None


def _has_unit(record: Record) -> bool:
    return isinstance(record, Weight) and record.unit != ""


def _shown(reply: Reply | None) -> str:
    return "nothing" if reply is None else repr(" ".join(reply).strip())
