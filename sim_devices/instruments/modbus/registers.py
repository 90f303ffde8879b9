"""What the registers of a load-cell transmitter hold, as the manuals of three makes have it.

Laumas TLU p. 30 and TLB4 protocols 1.03: holding registers, 40007 status (bit 0 cell, 1 converter, 2 beyond maximum,
7 gross negative, 8 net negative, 11 stable, 12 near zero), 40008 gross, 40010 net, 40012 peak, each an unsigned number
without decimal point, high word first; at most 32 registers in a request.
Dini Argeo DGT4X quick start p. 11: input registers, 30001 gross, 30003 net, 30005 status (bit 0 net negative, 1 gross
negative, 2 stable, 3 underload, 4 overload, 7 unloaded), 30111 microvolts.
Seneca Z-SG2 MI-005370 p. 42, 52: holding registers, 40003 unit in its high byte, 40064 net as float32, 40078 status
(bit 1 full scale reached, 2 negative, 4 stable).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from sim_devices.instruments.serial_lines.mt_sics_options import UNITS

SENECA_UNITS = {"kg": 0, "g": 1, "N": 5}
"""high byte of 40003."""


@dataclass(frozen=True, slots=True)
class ModbusCellOptions:
    """`[devices.<name>]` of kind modbus_cell."""

    kind: str
    port: str
    map: str = "laumas"
    baud: int = 9600
    address: int = 1
    unit: str = "kg"
    decimals: int = 3
    """Of the display; a Seneca sends a float."""
    word_order: str = "high_first"
    """Or `low_first`: of the two registers of a weight."""
    capacity: float = 500.0
    """N: beyond it the status says so."""
    rate: float = 80.0
    """conversions/s; a poll gets the last."""
    stable_band: float = 0.3
    """N."""
    clock_error: float = 0.0
    """relative: its clock runs faster by so much."""
    turnaround: float = 0.002
    """s from the end of a request to the start of the reply."""

    def __post_init__(self) -> None:
        if self.map not in MAPS:
            raise ValueError(f"map must be one of {', '.join(MAPS)}, got {self.map!r}")
        if self.unit not in UNITS:
            raise ValueError(f"unit must be one of {', '.join(UNITS)}, got {self.unit!r}")
        if self.word_order not in ("high_first", "low_first"):
            raise ValueError(f"word_order must be high_first or low_first, got {self.word_order!r}")
        if not 1 <= self.address <= 247:
            raise ValueError(f"address must be 1..247 (Modbus), got {self.address}")
        if self.rate <= 0 or not 0 <= self.decimals <= 6:
            raise ValueError("rate > 0 and decimals of 0 to 6 are needed")


class Shown(NamedTuple):
    """What a transmitter has to tell: `value` in its unit, and what is wrong."""

    value: float
    peak: float
    stable: bool
    over: bool
    under: bool
    converter: bool


class Made(NamedTuple):
    """A make: the functions that read, most registers of a request, and the registers by their number on the wire."""

    functions: tuple[int, ...]
    most: int
    registers: Callable[[ModbusCellOptions, Shown], dict[int, int]]
    faults: tuple[str, ...]
    """Those that its status has no word for, and which it cannot have here."""


def laumas(options: ModbusCellOptions, shown: Shown) -> dict[int, int]:
    negative = shown.value < 0
    status = 0b10 * shown.converter | 0b100 * (shown.over or shown.under) | 0x180 * negative | 0x800 * shown.stable
    status |= 0x1000 * (abs(counts(options, shown.value)) == 0)
    found = {0: 101, 1: 6, 2: 2016, 3: 4711, 4: 1, 5: 0, 6: status, 13: 0, 14: 0, 15: 0, 16: 0, 17: 0}
    for register, value in ((7, shown.value), (9, shown.value), (11, shown.peak)):
        found |= pair(register, struct.pack(">I", abs(counts(options, value))), options)
    return found


def dini_argeo_dgt(options: ModbusCellOptions, shown: Shown) -> dict[int, int]:
    value = counts(options, shown.value)
    status = 0b11 * (value < 0) | 0b100 * shown.stable | 0b1000 * shown.under | 0b10000 * shown.over
    found = {4: status | 0x80 * (value == 0), 5: 0, 6: 0, 110: 0, 111: 0, 112: 0, 113: 0}
    for register in (0, 2):
        found |= pair(register, struct.pack(">I", abs(value)), options)
    return found


def seneca_z_sg(options: ModbusCellOptions, shown: Shown) -> dict[int, int]:
    status = 0b10 * (shown.over or shown.under) | 0b100 * (shown.value < 0) | 0b10000 * shown.stable
    found = dict.fromkeys(range(100), 0) | {0: 33, 1: 100, 2: SENECA_UNITS[options.unit] << 8, 77: status}
    return found | pair(63, struct.pack(">f", shown.value), options)


def counts(options: ModbusCellOptions, value: float) -> int:
    """The display's number without its decimal point."""
    return round(value * 10.0**options.decimals)


def pair(register: int, data: bytes, options: ModbusCellOptions) -> dict[int, int]:
    high, low = struct.unpack(">HH", data)
    first, second = (high, low) if options.word_order == "high_first" else (low, high)
    return {register: first, register + 1: second}


MAPS = {
    "laumas": Made((3,), 32, laumas, ()),
    "dini_argeo_dgt": Made((4,), 125, dini_argeo_dgt, ("converter",)),
    "seneca_z_sg": Made((3, 4), 125, seneca_z_sg, ("converter",)),
}
