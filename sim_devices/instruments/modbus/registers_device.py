"""Device side of any Modbus RTU slave whose registers say what the world has: a meter, a thermometer, digital inputs.

Modbus application protocol V1.1b3: functions 3 and 4; exceptions 1 function, 2 address, 3 value, 4 device failure.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isnan

from sim_devices.wires.modbus_frames import Requests, framed
from sim_devices.wires.serial_line import DEFAULT_AMOUNT
from sim_devices.world.noise import CHANNELS

FORMS = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "float32": ">f"}
LARGEST = {"u16": (0, 0xFFFF), "i16": (-0x8000, 0x7FFF), "u32": (0, 2**32 - 1), "i32": (-(2**31), 2**31 - 1)}
CONTACT = "contact"
"""In the place of a world's channel: 1 while the emergency stop's contact is closed."""


@dataclass(frozen=True, slots=True)
class RegistersOptions:
    """`[devices.<name>]` of kind modbus_registers."""

    kind: str
    port: str
    values: tuple[str, ...]
    """`"register type channel scale"`: number on the wire = the world's channel / scale."""
    baud: int = 9600
    address: int = 1
    function: int = 3
    word_order: str = "high_first"
    turnaround: float = 0.004
    """s from the end of a request to the start of the reply."""

    def __post_init__(self) -> None:
        if not 1 <= self.address <= 247 or self.function not in (3, 4):
            raise ValueError(f"address 1..247 and function 3 or 4 are needed, got {self.address} and {self.function}")
        if self.word_order not in ("high_first", "low_first"):
            raise ValueError(f"word_order must be high_first or low_first, got {self.word_order!r}")
        if not self.values:
            raise ValueError('values needs at least one "register type channel scale"')
        for value in self.values:
            parsed(value)


def parsed(value: str) -> tuple[int, str, str, float]:
    """`"0 u16 bus_voltage 0.01"`. Raises ValueError."""
    words = value.split()
    if len(words) != 4 or words[1] not in FORMS or not words[0].isdigit():
        raise ValueError(f'values: expected "register type channel scale" of {", ".join(FORMS)}, got {value!r}')
    if words[2] not in (*CHANNELS, CONTACT):
        raise ValueError(f"values: {words[2]!r} is none of {', '.join((*CHANNELS, CONTACT))}")
    return int(words[0]), words[1], words[2], float(words[3])


class RegistersDevice:
    """One slave. `sample` gives a channel of the world by its name, SI."""

    faults = ("frozen", "silent", "bad_crc", "device_failure", "pressed")

    def __init__(self, options: RegistersOptions, sample: Callable[[str], float]) -> None:
        self._options, self._sample = options, sample
        self._values = [parsed(value) for value in options.values]
        self._requests = Requests()
        self._fault = ""
        self._held: dict[int, int] = {}

    due = inf

    def tick(self, _t: float) -> bytes:
        """A slave speaks when it is spoken to."""
        return b""

    def feed(self, data: bytes, t: float) -> bytes:
        return b"".join(self._reply(frame) for frame in self._requests.feed(data, t))

    def _reply(self, frame: bytes) -> bytes:
        address, function, start, count = struct.unpack(">BBHH", frame[:6])
        if address != self._options.address or self._fault == "silent":
            return b""
        if self._fault == "device_failure":
            return framed(bytes((address, function | 0x80, 4)))
        if function != self._options.function:
            return framed(bytes((address, function | 0x80, 1)))
        if not 1 <= count <= 125:
            return framed(bytes((address, function | 0x80, 3)))
        if self._fault != "frozen" or not self._held:
            self._held = self._registers()
        wanted = range(start, start + count)
        if any(each not in self._held for each in wanted):
            return framed(bytes((address, function | 0x80, 2)))
        words = b"".join(self._held[each].to_bytes(2, "big") for each in wanted)
        reply = framed(bytes((address, function, len(words))) + words)
        return reply[:-1] + bytes((reply[-1] ^ 0xFF,)) if self._fault == "bad_crc" else reply

    def _registers(self) -> dict[int, int]:
        """All registers from the first value to the last; those between two values are 0."""
        held: dict[int, int] = {}
        for register, form, channel, scale in self._values:
            data = self._coded(form, self._now(channel) / scale)
            words = [int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]
            words = words[::-1] if self._options.word_order == "low_first" else words
            held |= {register + at: word for at, word in enumerate(words)}
        return {each: held.get(each, 0) for each in range(min(held), max(held) + 1)}

    def _now(self, channel: str) -> float:
        if channel == CONTACT:
            return 0.0 if self._fault == "pressed" else 1.0
        return self._sample(channel)

    @staticmethod
    def _coded(form: str, value: float) -> bytes:
        """Rounded to the nearest, and kept at the ends of what the registers carry."""
        if form == "float32":
            return struct.pack(">f", value)
        low, high = LARGEST[form]
        return struct.pack(FORMS[form], low if isnan(value) else min(max(round(value), low), high))

    def fault(self, name: str, _t: float, _amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"slave: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault = name

    def clear(self, _t: float) -> None:
        self._fault, self._held = "", {}
