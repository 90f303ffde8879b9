"""Device side of a Keller 33X pressure and temperature transmitter: Modbus RTU slave.

Source: Keller, Communication Protocol for series 30 X, X-line, version 3.7: holding registers by function 3, one
float32 in two registers, high word first: 0x0000 CH0, 0x0002 P1 (bar), 0x0004 P2 (bar), 0x0006 T (degC),
0x0008 TOB1 (degC), 0x000A TOB2 (degC), and the same block again from 0x0100. Function 8 sub-function 0 echoes.
Frames: modbus_frames.py. Exceptions: 1 function, 2 address, 3 value.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from sim_devices.wires.modbus_frames import Requests, framed
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

BLOCK = 12
"""registers in the block of measured values."""
MIRROR = 0x0100
READ, DIAGNOSTICS = 3, 8


@dataclass(frozen=True, slots=True)
class KellerOptions:
    """`[devices.<name>]` of kind keller."""

    kind: str
    port: str
    baud: int = 9600
    address: int = 1
    turnaround: float = 0.004
    """s from the end of a request to the start of the reply."""

    def __post_init__(self) -> None:
        if not 1 <= self.address <= 247:
            raise ValueError(f"address must be 1..247 (Modbus), got {self.address}")


class Keller:
    """One transmitter. `pressure` gives Pa, `temperature` degC; NaN is sent as the NaN of float32."""

    faults = ("frozen", "silent", "bad_crc", "device_failure")

    def __init__(self, options: KellerOptions, pressure: Callable[[], float], temperature: Callable[[], float]) -> None:
        self._options, self._pressure, self._temperature = options, pressure, temperature
        self._requests = Requests()
        self._fault = ""
        self._values = self._measure()

    due = inf

    def feed(self, data: bytes, t: float) -> bytes:
        return b"".join(self._reply(frame) for frame in self._requests.feed(data, t))

    def tick(self, _t: float) -> bytes:
        """A slave speaks when it is spoken to."""
        return b""

    def _reply(self, frame: bytes) -> bytes:
        address, function, start, count = struct.unpack(">BBHH", frame[:6])
        if address != self._options.address or self._fault == "silent":
            return b""
        if self._fault == "device_failure":
            return framed(bytes((address, function | 0x80, 4)))
        if function == DIAGNOSTICS and start == 0:
            return frame
        if function != READ:
            return framed(bytes((address, function | 0x80, 1)))
        first = start - MIRROR if start >= MIRROR else start
        if not 1 <= count <= 125:
            return framed(bytes((address, function | 0x80, 3)))
        if first + count > BLOCK:
            return framed(bytes((address, function | 0x80, 2)))
        data = self._registers()[2 * first : 2 * (first + count)]
        reply = framed(bytes((address, function, len(data))) + data)
        return reply[:-1] + bytes((reply[-1] ^ 0xFF,)) if self._fault == "bad_crc" else reply

    def _measure(self) -> tuple[float, float]:
        return self._pressure(), self._temperature()

    def _registers(self) -> bytes:
        if self._fault != "frozen":
            self._values = self._measure()
        pressure, temperature = self._values
        bar = pressure / 1e5
        return struct.pack(">6f", 0.0, bar, 0.0, temperature, temperature, temperature)

    def fault(self, name: str, _t: float, _amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"thermometer: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault = name

    def clear(self, _t: float) -> None:
        self._fault = ""
