"""Device side of any CAN device that sends what it measures by itself: frames of numbers at byte boundaries."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, isnan

from sim_devices.wires.can_frame import CanFrame
from sim_devices.wires.serial_line import DEFAULT_AMOUNT
from sim_devices.world.noise import CHANNELS

FORMS = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "float32": "f"}
ORDERS = {"little": "<", "big": ">"}
CONTACT = "contact"
"""In the place of a world's channel: 1 while the emergency stop's contact is closed."""


@dataclass(frozen=True, slots=True)
class CanSignalsOptions:
    """`[devices.<name>]` of kind can_signals."""

    kind: str
    values: tuple[str, ...]
    """`"byte type channel scale"`: number in the frame = the world's channel / scale."""
    id: int = 0x100
    extended: bool = False
    length: int = 8
    rate: float = 50.0
    """frames/s"""
    byte_order: str = "little"
    clock_error: float = 0.0
    """relative: its clock runs faster by so much."""

    def __post_init__(self) -> None:
        if not (self.rate > 0 and 1 <= self.length <= 8 and 0 <= self.id <= (0x1FFFFFFF if self.extended else 0x7FF)):
            raise ValueError("rate above 0, length 1 to 8 and an id of 11 bits, or 29 where it is extended, are needed")
        if self.byte_order not in ORDERS:
            raise ValueError(f"byte_order must be little or big, got {self.byte_order!r}")
        for value in self.values:
            at, form, _, _ = parsed(value)
            if at + struct.calcsize(f"<{FORMS[form]}") > self.length:
                raise ValueError(f"values: {value!r} is beyond a frame of {self.length} bytes")


def parsed(value: str) -> tuple[int, str, str, float]:
    """`"0 i32 current 0.001"`. Raises ValueError."""
    words = value.split()
    if len(words) != 4 or words[1] not in FORMS or not words[0].isdigit():
        raise ValueError(f'values: expected "byte type channel scale" of {", ".join(FORMS)}, got {value!r}')
    if words[2] not in (*CHANNELS, CONTACT):
        raise ValueError(f"values: {words[2]!r} is none of {', '.join((*CHANNELS, CONTACT))}")
    return int(words[0]), words[1], words[2], float(words[3])


class CanSender:
    """One device. `sample` gives a channel of the world by its name, SI."""

    faults = ("frozen", "silent", "short", "pressed")

    def __init__(self, options: CanSignalsOptions, sample: Callable[[str], float]) -> None:
        self._options, self._sample = options, sample
        self._values = [parsed(value) for value in options.values]
        self._next = self._period = 1.0 / (options.rate * (1.0 + options.clock_error))
        self._fault = ""
        self._held = b""

    @property
    def due(self) -> float:
        return inf if self._fault == "silent" else self._next

    def receive(self, _frame: CanFrame, _t: float) -> Sequence[CanFrame]:
        return ()

    def tick(self, t: float) -> Sequence[CanFrame]:
        frames = []
        while self._next <= t:
            self._next += self._period
            if self._fault != "frozen" or not self._held:
                self._held = self._data()
            data = self._held[:-1] if self._fault == "short" else self._held
            frames.append(CanFrame(self._options.id, data, self._options.extended))
        return frames

    def _data(self) -> bytes:
        data = bytearray(self._options.length)
        for at, form, channel, scale in self._values:
            struct.pack_into(
                ORDERS[self._options.byte_order] + FORMS[form], data, at, self._number(form, channel, scale)
            )
        return bytes(data)

    def _number(self, form: str, channel: str, scale: float) -> float | int:
        """Rounded to the nearest, and kept at the ends of what its bytes carry."""
        contact = 0.0 if self._fault == "pressed" else 1.0
        value = contact if channel == CONTACT else self._sample(channel) / scale
        if form == "float32":
            return value
        bits = 8 * struct.calcsize(FORMS[form])
        low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if form[0] == "i" else (0, 2**bits - 1)
        return low if isnan(value) else min(max(round(value), low), high)

    def fault(self, name: str, _t: float, _amount: float = DEFAULT_AMOUNT) -> None:
        if name not in self.faults:
            raise ValueError(f"CAN device: expected one of {', '.join(self.faults)}, got {name!r}")
        self._fault = name

    def clear(self, t: float) -> None:
        self._fault, self._held = "", b""
        self._next = max(self._next, t)
