"""Device side of a load-cell transmitter on Modbus RTU: converts at its own rate, answers with the last conversion.

What its registers hold: registers.py. Modbus application protocol V1.1b3: exceptions 1 function, 2 address,
3 value, 4 device failure, 6 busy.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from math import isnan

from sim_devices.instruments.lies import LIES, Lying
from sim_devices.instruments.modbus.registers import MAPS, ModbusCellOptions, Shown
from sim_devices.instruments.serial_lines.mt_sics_options import UNITS
from sim_devices.wires.modbus_frames import Requests, framed
from sim_devices.wires.serial_line import DEFAULT_AMOUNT

STABLE_WINDOW = 0.5
"""s over which a stable reading may not move by more than `stable_band`."""
EXCEPTIONS = {"device_failure": 4, "busy": 6}


class ModbusCell:
    """One transmitter. `read` gives the force on the cell in N (NaN: the converter has no number)."""

    faults = (
        "frozen",
        "silent",
        "overload",
        "underload",
        "converter",
        "wrong_unit",
        "words_exchanged",
        "wrong_address",
        "bad_crc",
        *EXCEPTIONS,
        *LIES,
    )

    def __init__(self, options: ModbusCellOptions, read: Callable[[], float]) -> None:
        self._options = self._set = options
        self._made = MAPS[options.map]
        self._read = self._lying = Lying(read, 10.0**-options.decimals * UNITS[options.unit])
        self._requests = Requests()
        self._fault = ""
        self._next = 0.0
        self._recent: deque[float] = deque(maxlen=max(round(STABLE_WINDOW * options.rate), 2))
        self._value = self._peak = 0.0
        self._convert()

    @property
    def due(self) -> float:
        return self._next

    def feed(self, data: bytes, t: float) -> bytes:
        return b"".join(self._reply(frame) for frame in self._requests.feed(data, t))

    def tick(self, t: float) -> bytes:
        """Convert; a slave speaks when it is spoken to."""
        while self._next <= t:
            self._next += 1.0 / (self._options.rate * (1.0 + self._options.clock_error))
            self._convert()
        return b""

    def fault(self, name: str, _t: float, amount: float = DEFAULT_AMOUNT) -> None:
        known = [each for each in self.faults if each not in self._made.faults]
        if name not in known:
            raise ValueError(f"load cell: expected one of {', '.join(known)}, got {name!r}")
        self._fault, self._set = name, self._options
        self._lying.begin(name if name in LIES else "", amount)
        if name == "wrong_unit":
            self._set = replace(self._options, unit="kg" if self._options.unit == "N" else "N")
        elif name == "words_exchanged":
            order = "low_first" if self._options.word_order == "high_first" else "high_first"
            self._set = replace(self._options, word_order=order)

    def clear(self, _t: float) -> None:
        self._fault, self._set = "", self._options
        self._lying.begin("", DEFAULT_AMOUNT)

    def _convert(self) -> None:
        if self._fault == "frozen":
            return
        self._value = self._read()
        self._recent.append(self._value)
        self._peak = max(self._peak, self._value)

    def _reply(self, frame: bytes) -> bytes:
        address, function, start, count = struct.unpack(">BBHH", frame[:6])
        if address != self._options.address or self._fault == "silent":
            return b""
        if code := EXCEPTIONS.get(self._fault, 0):
            return framed(bytes((address, function | 0x80, code)))
        if function not in self._made.functions:
            return framed(bytes((address, function | 0x80, 1)))
        if not 1 <= count <= self._made.most:
            return framed(bytes((address, function | 0x80, 3)))
        registers = self._made.registers(self._set, self._shown())
        wanted = range(start, start + count)
        if any(each not in registers for each in wanted):
            return framed(bytes((address, function | 0x80, 2)))
        words = struct.pack(f">{count}H", *(registers[each] for each in wanted))
        says = address % 247 + 1 if self._fault == "wrong_address" else address
        reply = framed(bytes((says, function, len(words))) + words)
        return reply[:-1] + bytes((reply[-1] ^ 0xFF,)) if self._fault == "bad_crc" else reply

    def _shown(self) -> Shown:
        value, newtons = self._value, UNITS[self._set.unit]
        none = isnan(value)
        over = self._fault == "overload" or value > self._options.capacity or none
        under = self._fault == "underload" or value < -self._options.capacity
        return Shown(
            value=0.0 if none else value / newtons,
            peak=self._peak / newtons,
            stable=not none and len(self._recent) == self._recent.maxlen and self._is_still(),
            over=over,
            under=under,
            converter=none or self._fault == "converter",
        )

    def _is_still(self) -> bool:
        return max(self._recent) - min(self._recent) <= self._options.stable_band
