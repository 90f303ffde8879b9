"""Device side of a Peacefair PZEM-003/017 DC power meter: Modbus RTU slave, renewed once a second.

Source: Peacefair PZEM-003/017 user manual: input registers 0x0000 voltage 0.01 V, 0x0001 current 0.01 A, 0x0002 power
0.1 W low word, 0x0003 high word, 0x0004 and 0x0005 energy Wh, 0x0006 and 0x0007 alarms (0xFFFF on); holding registers
0x0000 and 0x0001 alarm thresholds 0.01 V, 0x0002 address, 0x0003 shunt (0: 100 A, 1: 50 A, 2: 200 A, 3: 300 A). It
begins to measure at 0.02 A. Frames: modbus_frames.py.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from sim_devices.wires.modbus_frames import Requests, framed
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

LEAST = 0.02
"""A"""
SHUNTS = {100: 0, 50: 1, 200: 2, 300: 3}


@dataclass(frozen=True, slots=True)
class PzemOptions:
    """`[devices.<name>]` of kind pzem."""

    kind: str
    port: str
    baud: int = 9600
    address: int = 1
    shunt: int = 100
    """A, that it is set to."""
    update: float = 1.0
    """s between two renewals of its values."""
    high_alarm: float = 300.0
    """V"""
    low_alarm: float = 7.0
    """V"""
    turnaround: float = 0.02
    """s from the end of a request to the start of the reply."""

    def __post_init__(self) -> None:
        if not 1 <= self.address <= 247 or self.shunt not in SHUNTS or self.update <= 0.0:
            raise ValueError(
                f"address 1..247, a shunt of {', '.join(map(str, SHUNTS))} A and update > 0 s are needed, got"
                f" {self.address}, {self.shunt} and {self.update}"
            )


class Pzem:
    """One meter. `voltage` gives V, `current` A of the supply."""

    faults = ("frozen", "silent", "bad_crc", "device_failure", "current_factor", "wrong_shunt")

    def __init__(self, options: PzemOptions, voltage: Callable[[], float], current: Callable[[], float]) -> None:
        self._options, self._voltage, self._current = options, voltage, current
        self._requests = Requests()
        self._fault, self._amount = "", DEFAULT_AMOUNT
        self._next, self._energy = options.update, 0.0
        self._values = self._measure()

    @property
    def due(self) -> float:
        return self._next

    def tick(self, t: float) -> bytes:
        """A slave speaks when it is spoken to; it renews its values."""
        while self._next <= t:
            self._next += self._options.update
            volts, amps = self._measure()
            self._energy += volts * amps * self._options.update / 3600.0
            if self._fault != "frozen":
                self._values = volts, amps
        return b""

    def _measure(self) -> tuple[float, float]:
        amps = abs(self._current())
        amps *= self._amount if self._fault == "current_factor" else 1.0
        return max(self._voltage(), 0.0), amps if amps >= LEAST else 0.0

    def feed(self, data: bytes, t: float) -> bytes:
        return b"".join(self._reply(frame) for frame in self._requests.feed(data, t))

    def _reply(self, frame: bytes) -> bytes:
        address, function, start, count = struct.unpack(">BBHH", frame[:6])
        if address != self._options.address or self._fault == "silent":
            return b""
        if self._fault == "device_failure":
            return framed(bytes((address, function | 0x80, 4)))
        if function not in (3, 4):
            return framed(bytes((address, function | 0x80, 1)))
        registers = self._measured() if function == 4 else self._settings()
        if count < 1 or start + count > len(registers):
            return framed(bytes((address, function | 0x80, 2)))
        data = struct.pack(f">{count}H", *registers[start : start + count])
        reply = framed(bytes((address, function, len(data))) + data)
        return reply[:-1] + bytes((reply[-1] ^ 0xFF,)) if self._fault == "bad_crc" else reply

    def _measured(self) -> list[int]:
        volts, amps = self._values
        power, energy = round(volts * amps * 10), int(self._energy)
        alarms = [0xFFFF * (volts > self._options.high_alarm), 0xFFFF * (volts < self._options.low_alarm)]
        shown = [round(volts * 100), round(amps * 100), power & 0xFFFF, power >> 16, energy & 0xFFFF, energy >> 16]
        return [min(each, 0xFFFF) for each in shown] + alarms

    def _settings(self) -> list[int]:
        o = self._options
        shunt = SHUNTS[50 if o.shunt == 100 else 100] if self._fault == "wrong_shunt" else SHUNTS[o.shunt]
        return [round(o.high_alarm * 100), round(o.low_alarm * 100), o.address, shunt]

    def fault(self, name: str, _t: float, amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"power meter: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault, self._amount = name, amount

    def clear(self, _t: float) -> None:
        self._fault = ""
