"""Force from a load cell on a Loadstar DI-100 or DI-1000 interface: values in its unit, or raw counts at 1 kHz.

It sends by itself, at a rate of its own, until it gets an empty command. Its zero is in the interface alone: the rig
prefers to tare by subtraction.
"""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from drivers.acquisition import Acquisition
from drivers.errors import DeviceError, LinkError
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import (
    check_line_rate,
    line_time,
    printable,
)
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import QUARTZ, Channel, LinkHealth, Sample, Stream
from drivers.serial_lines.loadstar_lines import (
    COUNT_CHARACTERS,
    IGNORED_COUNT,
    UNITS,
    VALUE_CHARACTERS,
    Counts,
    Decoder,
    Record,
    Text,
    Value,
    encode,
)

SETTLE = 0.1
"""s for what was still streaming to arrive, once it was ended."""


@dataclass(frozen=True, slots=True)
class Options(Acquisition):
    """`[devices.<name>]` of kind loadstar."""

    port: str
    rate: float
    """Values/s that the interface sends: about 70 (DI-1000U), 500 (DI-1000UHS), 575 or 1000 (DI-1000UHS-1K)."""
    mode: Literal["decimal", "hex"] = "decimal"
    """`hex`: raw counts (`H`), which a DI-1000UHS-1K alone sends."""
    baud: int = 9600
    """230400 of the fast models."""
    sign: Literal[1, -1] = 1
    """+1: the cell's positive direction is forward thrust."""
    unit: str | None = None
    """Unit the interface must be set to; None takes the one it has when opened."""
    resolution: float | None = None
    """N, one digit or one count."""
    range_min: float | None = None
    """N"""
    range_max: float | None = None
    """N"""
    timeout: float = 2.0
    """s for an answer."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        SerialSettings(self.port, self.baud)
        if self.mode not in ("decimal", "hex"):
            raise ValueError(f"loadstar mode must be decimal or hex, not {self.mode!r}")
        check_line_rate("loadstar", self.rate, self.baud, "8N1", self.characters)
        if self.sign not in (1, -1):
            raise ValueError(f"loadstar sign must be 1 or -1, not {self.sign}")
        if self.unit is not None and self.unit.lower() not in UNITS:
            raise ValueError(f"loadstar unit must be one of {', '.join(UNITS)} (in any case), not {self.unit!r}")
        self.check_acquisition("loadstar")
        if not 0.0 < self.timeout <= 60.0:
            raise ValueError(f"loadstar timeout must be between 0 and 60 s, not {self.timeout}")

    @property
    def characters(self) -> int:
        """Of a value on the line."""
        return COUNT_CHARACTERS if self.mode == "hex" else VALUE_CHARACTERS


class Loadstar:
    """A force sensor: stream `<name>` with `thrust` [N], in hex mode also `raw` counts."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        settings = SerialSettings(options.port, options.baud, capture=options.capture)
        self._port: SerialPort[Record] = SerialPort(name, settings, Decoder().feed, wire)
        self._bad = BadRecords()
        self._newtons = math.nan
        """Per unit or count."""
        self.ignored = 0
        """Counts of -1, which the maker says to ignore."""

    @property
    def streams(self) -> tuple[Stream, ...]:
        options, hexadecimal = self._options, self._options.mode == "hex"
        formula = "thrust = sign * counts * weight per count (SWC)" if hexadecimal else "thrust = sign * reading"
        calibration = {"formula": f"{formula} * newtons per unit", "sign": options.sign, "gain_std": options.gain_std}
        thrust = Channel(
            "thrust", "thrust", "N", noise_std=options.noise_std, quantum=options.resolution,
            delay=options.delay + line_time(options.baud, "8N1", options.characters), delay_std=options.delay_std,
            window=options.window, low_pass=options.low_pass, filter=options.filter, range_min=options.range_min,
            range_max=options.range_max, calibration=json.dumps(calibration),
        )  # fmt: skip
        raw = Channel("raw", None, "1", integer=True, description="counts as sent")
        return (Stream(self.name, "loadstar", (thrust, raw) if hexadecimal else (thrust,), 1.0 / options.rate, QUARTZ),)

    def open(self) -> str:
        """Ends an old stream, asks who it is and in which unit, and lets it stream."""
        self._bad, self.ignored = BadRecords(), 0
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            identity = self._identify()
            self._newtons = self._scale()
            self._start()
            undo.pop_all()
        return identity

    def drain(self) -> list[Sample]:
        samples: list[Sample] = []
        hexadecimal = self._options.mode == "hex"
        for t_ns, record in self._port.inbox.take_all():
            match record:
                case Counts(counts) if hexadecimal:
                    if counts == IGNORED_COUNT:
                        self.ignored += 1
                    else:
                        samples.append(Sample(self.name, t_ns, (counts * self._newtons, float(counts))))
                case Value(value) if not hexadecimal:
                    samples.append(Sample(self.name, t_ns, (value * self._newtons,)))
                case Text(line):
                    self._bad.add(printable(line))
                case _:
                    self._bad.add(str(record))
        return samples

    def health(self) -> LinkHealth:
        inbox, bad = self._port.inbox, self._bad
        return LinkHealth(self._port.alive, inbox.received, bad.count, bad.first, self._port.error, inbox.dropped)

    def tare(self) -> None:
        """Zero inside the interface (`TARE`), which ends the stream for a moment.

        Call it from the thread that drains. Raises LinkError, or DeviceError when it does not say `Tared`.
        """
        self._end_stream()
        answer = self._ask("TARE", lambda words: words == "Tared")
        self._start()
        if answer is None:
            raise DeviceError(f"{self.name}: TARE expected 'Tared', came nothing: tare by subtraction")

    def close(self) -> None:
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone, and with it the stream to end
                self._port.write(encode(""))
        self._port.close()

    # -- opening -----------------------------------------------------------------------------------------------------

    def _identify(self) -> str:
        o = self._options
        self._end_stream()
        if self._ask("", lambda words: words == "A") is None:
            raise DeviceError(
                f"{self.name}: no Loadstar interface answers on {o.port} at {o.baud} baud 8N1 (an empty command"
                f" expected 'A', came {self._came()}): check baud (9600, or 230400 of the fast models) and power"
            )
        model = self._require("MODEL", lambda words: "DI-100" in words, "a name with DI-100 or DI-1000")
        serial = self._require("ID", _is_answer, "its serial number")
        capacity = self._require("LC", _is_answer, "the capacity of its cell")
        return f"Loadstar {model}, {serial}, capacity {capacity}"

    def _scale(self) -> float:
        o = self._options
        unit = self._require("UNIT", _is_answer, "the name of a unit")
        if unit.lower() not in UNITS:
            raise DeviceError(
                f"{self.name} shows {unit}, which is no force: set it to N (UNITS N), or look at the sensor"
            )
        if o.unit is not None and unit.lower() != o.unit.lower():
            raise DeviceError(f"{self.name} shows {unit}, the bench file says {o.unit}: change one of them")
        newtons = o.sign * UNITS[unit.lower()]
        if o.mode == "decimal":
            return newtons
        per_count = self._require("SWC", _is_positive, "the weight of one count; a DI-1000UHS-1K alone has hex mode")
        return newtons * float(per_count)

    def _start(self) -> None:
        self._port.inbox.take_all()
        kind = Counts if self._options.mode == "hex" else Value
        self._port.write(encode("H" if self._options.mode == "hex" else "WC"))
        first = self._port.inbox.wait_for(lambda r: isinstance(r, kind), self._options.timeout, take=False)
        if first is None:
            raise DeviceError(
                f"{self.name} sends no values within {self._options.timeout:g} s (came {self._came()}): is mode"
                f" {self._options.mode!r} one that this model has?"
            )

    def _end_stream(self) -> None:
        """An empty command, and what was still on its way is let go."""
        self._port.write(encode(""))
        self._port.inbox.wait_for(lambda _: False, SETTLE)
        self._port.inbox.take_all()

    def _ask(self, command: str, right: Callable[[str], bool]) -> str | None:
        record = self._port.ask(encode(command), lambda r: right(_words(r)), self._options.timeout)
        return None if record is None else _words(record)

    def _require(self, command: str, right: Callable[[str], bool], expected: str) -> str:
        self._port.inbox.take_all()
        answer = self._ask(command, right)
        if answer is None:
            raise DeviceError(f"{self.name}: {command} expected {expected}, came {self._came()}")
        return answer

    def _came(self) -> str:
        seen = [_words(record) for _, record in self._port.inbox.take_all()]
        return repr(seen[:3]) if seen else "nothing"


def _words(record: Record) -> str:
    """An answer that is a number may look like a value."""
    return record.words if isinstance(record, Text) else str(record[0])


def _is_answer(words: str) -> bool:
    return words not in ("", "A", "E")


def _is_positive(words: str) -> bool:
    try:
        return 0.0 < float(words) < math.inf
    except ValueError:
        return False
