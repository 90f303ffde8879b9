"""Water temperature and pressure from a Keller transmitter (33X, 35X, PD-33X and other X-line) by Modbus RTU.

Source: Keller, Description of the Communication Protocol, X-line 3.7: function 3, float32 big endian, high word first;
0x0002 P1 [bar], 0x0008 TOB1 [degC]; 9600 8N1. The instrument is polled: two requests a row.
"""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.errors import DeviceError
from drivers.modbus.poll import ModbusPoll
from drivers.modbus.rtu import Read, Registers, Unreadable
from drivers.ports.inbox import BadRecords
from drivers.ports.lines import check_line_rate
from drivers.ports.serial_port import SerialSettings
from drivers.ports.wire import Wire
from drivers.protocols import Channel, LinkHealth, Sample, Stream

P1, TOB1 = 0x0002, 0x0008
"""Register addresses as on the wire."""
PASCAL_PER_BAR = 1e5
POLL_CHARACTERS = 2 * (8 + 9) + 2 * 14
"""Two requests of 8 and two replies of 9 characters, four gaps of 3.5 (Modbus over serial line 1.02, 2.5.1.1)."""


def decode_float(registers: Sequence[int]) -> float:
    """Two registers, high word first, to a float32. Raises ValueError for another number of registers."""
    if len(registers) != 2:
        raise ValueError(f"a float32 takes 2 registers, came {len(registers)}")
    value: float = struct.unpack(">f", struct.pack(">HH", *registers))[0]
    return value


def encode_float(value: float) -> list[int]:
    """A float32 as two registers, high word first."""
    return list(struct.unpack(">HH", struct.pack(">f", value)))


@dataclass(frozen=True, slots=True)
class Options:
    """`[devices.<name>]` of kind keller."""

    port: str
    rate: float = 2.0
    """Polls/s."""
    baud: int = 9600
    address: int = 1
    timeout: float = 0.5
    """s for a reply."""
    capture: str = ""
    """File that gets every byte with its time."""

    def __post_init__(self) -> None:
        if not self.port:
            raise ValueError("keller port is empty: give a device path such as /dev/ttyUSB0")
        check_line_rate("keller", self.rate, self.baud, "8N1", POLL_CHARACTERS)
        if not 1 <= self.address <= 247:
            raise ValueError(f"keller address must be 1 to 247 (Modbus), not {self.address}")
        if not 0.0 < self.timeout <= 10.0:
            raise ValueError(f"keller timeout must be between 0 and 10 s, not {self.timeout}")


class Keller:
    """Stream `<name>`: `water_temperature` [degC] and `pressure` [Pa]."""

    def __init__(self, name: str, options: Options, wire: Wire | None = None) -> None:
        self.name = name
        self._options = options
        settings = SerialSettings(options.port, options.baud, capture=options.capture)
        self._poll = ModbusPoll(name, settings, options.timeout, wire)
        self._requests = [Read(options.address, 3, register, 2) for register in (TOB1, P1)]
        self._bad = BadRecords()
        self._temperature: float | None = None

    @property
    def streams(self) -> tuple[Stream, ...]:
        temperature = Channel("water_temperature", "water_temperature", "degC", description="TOB1")
        pressure = Channel("pressure", None, "Pa", description="P1")
        return (Stream(self.name, "keller", (temperature, pressure), 1.0 / self._options.rate),)

    def open(self) -> str:
        """Opens the port and asks once. Raises LinkError, or DeviceError when nobody answers."""
        self._bad, self._temperature = BadRecords(), None
        self._poll.open()
        with contextlib.ExitStack() as undo:
            undo.callback(self.close)
            self._identify()
            self._poll.start(self._requests, self._options.rate)
            undo.pop_all()
        return f"Keller transmitter, Modbus address {self._options.address} (serial number not read)"

    def drain(self) -> list[Sample]:
        """A row is a temperature and the pressure that was asked for after it, stamped when the latter came."""
        samples = []
        for t_ns, record in self._poll.take():
            if not isinstance(record, Registers):
                self._bad.add(record.text if isinstance(record, Unreadable) else str(record))
            elif record.register == TOB1:
                self._temperature = decode_float(record.words)
            elif self._temperature is not None:
                values = (self._temperature, decode_float(record.words) * PASCAL_PER_BAR)
                samples.append(Sample(self.name, t_ns, values))
                self._temperature = None
        return samples

    def health(self) -> LinkHealth:
        poll, bad = self._poll, self._bad
        return LinkHealth(poll.alive, poll.received, bad.count, bad.first, poll.error, poll.dropped)

    def close(self) -> None:
        self._poll.close()

    def _identify(self) -> None:
        try:
            for request in self._requests:
                self._poll.ask(request)
        except DeviceError as error:
            why = str(error).rpartition(": ")[2]
            raise DeviceError(
                f"{self.name}: no Keller transmitter answers at address {self._options.address} on"
                f" {self._options.port}, {self._options.baud} 8N1 ({why}): check address, baud and power"
            ) from error
