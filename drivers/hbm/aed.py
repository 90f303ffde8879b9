"""Force from HBM's AED, AD101B to AD104 or FIT electronics on RS-232 or RS-485.

While values stream (`MSV?0`) nothing may be set, so everything is set before and read back, and `STP` comes first.
Nothing is stored (`TDD1`): after power-up the electronics are as they were delivered or as you stored them, silent.
The tare of the electronics is not used by a run.
"""

from __future__ import annotations

import contextlib
import math

from drivers.errors import DeviceError, LinkError
from drivers.hbm.frames import (
    BINARY,
    DELIMITER,
    STANDSTILL,
    Answer,
    Decoder,
    Record,
    Unreadable,
    Value,
    encode,
    shown,
)
from drivers.hbm.options import Options, stream
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import printable
from drivers.ports.serial_port import SerialPort, SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import LinkHealth, Sample, Stream

DONE, REFUSED = "0", "?"
STOP = encode("STP")


class HbmAed:
    """A force sensor: stream `<name>` with `thrust` [N], `stable`, `status` and `raw` digits."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        self._decoder = Decoder()
        settings = SerialSettings(options.port, options.baud, options.framing, options.capture)
        self._port: SerialPort[Record] = SerialPort(name, settings, self._decoder.feed, wire)
        self._bad = BadRecords()

    @property
    def streams(self) -> tuple[Stream, ...]:
        return (stream(self.name, self._options),)

    def open(self) -> str:
        self._bad = BadRecords()
        self._decoder.end_binary()
        self._port.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            identity = self._identify()
            self._configure()
            self._start()
            undo.pop_all()
        return identity

    def drain(self) -> list[Sample]:
        samples = []
        for t_ns, record in self._port.inbox.take_all():
            match record:
                case Value(digits, status):
                    samples.append(Sample(self.name, t_ns, self._row(record, digits, status)))
                case Answer(text):
                    self._bad.add(text)
                case Unreadable(line):
                    self._bad.add(printable(line))
        return samples

    def health(self) -> LinkHealth:
        inbox, error = self._port.inbox, self._port.error
        return LinkHealth(self._port.alive, inbox.received, self._bad.count, self._bad.first, error, inbox.dropped)

    def tare(self) -> None:
        """Zero inside the electronics (`TAR`, which then send net values). The stream stops meanwhile.

        Call it from the thread that drains. Raises LinkError, or DeviceError when the device refuses.
        """
        self._stop()
        answer = self._ask("TAR")
        self._start()
        if answer != DONE:
            raise DeviceError(f"{self.name}: 'TAR' expected '{DONE}', came {answer!r}: unload the cell, or tare by"
                              " subtraction")  # fmt: skip

    def close(self) -> None:
        if self._port.alive:
            with contextlib.suppress(LinkError):  # the wire is gone, and with it the stream that STP would end
                self._port.write(STOP)
        self._port.close()

    def _row(self, value: Value, digits: int, status: int) -> tuple[float, ...]:
        thrust = digits * self._options.newtons_per_digit if value.valid else math.nan
        return thrust, float(status & STANDSTILL != 0), float(status), float(digits)

    # -- opening -----------------------------------------------------------------------------------------------------

    def _identify(self) -> str:
        """Asked twice: the first answer may come behind half a value of the stream that is stopped here."""
        o = self._options
        self._stop()
        for _ in range(2):
            record = self._port.ask(encode("IDN?"), _is_identity, o.timeout)
            if isinstance(record, Answer):
                return record.text
        heard = "; ".join(shown(record) for _, record in self._port.inbox.take_all()[:3])
        raise DeviceError(
            f"{self.name}: no HBM electronics answer on {o.port} at {o.baud} baud {o.framing}"
            + ("" if o.address is None else f", address {o.address}")
            + f" ('IDN?' expected 'HBM,...', came {heard or 'nothing'}): check baud, framing, address and power"
        )

    def _stop(self) -> None:
        """`;` ends half a command; `STP` and `S..` are not answered."""
        o = self._options
        self._port.write(b";" + STOP + (b"" if o.address is None else encode(f"S{o.address:02d}")))
        self._decoder.end_binary()

    def _configure(self) -> None:
        o = self._options
        self._set("COF", o.output_format)
        self._set("TEX", DELIMITER)
        if o.output_format == BINARY:
            self._require_status()
        self._set("ICR", o.rate_code)
        if o.filter_mode is not None:
            self._set("FMD", o.filter_mode)
        if o.filter_stage is not None:
            self._set("ASF", o.filter_stage)
        if (nominal := self._number("NOV")) != o.nominal_value:
            raise DeviceError(
                f"{self.name}: the electronics show {nominal} digits at nominal load (NOV), the bench file says"
                f" nominal_value = {o.nominal_value}: correct one of them"
            )

    def _require_status(self) -> None:
        """The last byte of COF8 is a checksum where CSM is 1, and the status where it is 0 or not known."""
        if self._ask("CSM0") not in (DONE, REFUSED):
            raise DeviceError(f"{self.name}: 'CSM0' is not answered: is the baud rate right, and the line short?")
        if self._ask("CSM?") not in (REFUSED, None) and self._number("CSM") != 0:
            raise DeviceError(f"{self.name} sends a checksum in the place of the status and does not end it (CSM)")

    def _set(self, name: str, value: int) -> None:
        answer = self._ask(f"{name}{value}")
        if answer != DONE:
            raise DeviceError(
                f"{self.name} does not accept '{name}{value}' (came {'nothing' if answer is None else repr(answer)}):"
                " is that a setting of this model?"
            )
        if (actual := self._number(name)) != value:
            raise DeviceError(f"{self.name} was set to {name}{value} and says {name}{actual}")

    def _number(self, name: str) -> int:
        """A setting as it is: `08`, `+0000008`, or several with commas, of which the first counts."""
        answer = self._ask(f"{name}?")
        try:
            return int((answer or "").split(",")[0])
        except ValueError:
            raise DeviceError(f"{self.name}: '{name}?' expected a number, came {answer!r}") from None

    def _ask(self, command: str) -> str | None:
        self._port.inbox.take_all()
        record = self._port.ask(encode(command), lambda r: isinstance(r, Answer), self._options.timeout)
        return record.text if isinstance(record, Answer) else None

    def _start(self) -> None:
        self._port.inbox.take_all()
        if self._options.output_format == BINARY:
            self._decoder.begin_binary()
        self._port.write(encode("MSV?0"))
        wait = self._options.timeout + 2.0 / self._options.rate
        if self._port.inbox.wait_for(lambda r: isinstance(r, Value), wait, take=False) is None:
            raise DeviceError(
                f"{self.name} sends no value after 'MSV?0' within {wait:.2g} s"
                f" ({self._port.error or 'another format, or still starting'}): switch it off and on"
            )


def _is_identity(record: Record) -> bool:
    return isinstance(record, Answer) and record.text.upper().startswith("HBM")
