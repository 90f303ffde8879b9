"""Words of a reply to a weight as the display shows it, and whether two words are in the order that is believed."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from drivers.modbus.maps import NumberType, Reading, RegisterMap, WordOrder

SMALLEST = 1e-15
"""Of the largest weight: a float that is smaller and not 0 is a small integer taken for a float, or words exchanged."""


def number(words: Sequence[int], kind: NumberType, order: WordOrder) -> float:
    """One or two 16-bit words as they came. Raises ValueError for another number of words."""
    if len(words) != (1 if kind in ("u16", "i16") else 2):
        raise ValueError(f"{kind} is not {len(words)} registers")
    ordered = tuple(words) if order == "high_first" else tuple(reversed(words))
    data = struct.pack(f">{len(words)}H", *ordered)
    code = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i", "magnitude": ">I", "float32": ">f"}[kind]
    return float(struct.unpack(code, data)[0])


def weight(block: Sequence[int], first: int, found: RegisterMap, reading: Reading, order: WordOrder) -> float:
    """The reading of a block of registers that begins at `first`, with its sign; in counts, or as a float is."""
    at = reading.register - first
    value = number(block[at : at + reading.count], reading.type, order)
    negative = reading.negative is not None and bool(status(block, first, found) >> reading.negative & 1)
    return -value if negative else value


def status(block: Sequence[int], first: int, found: RegisterMap) -> int:
    """The status register; 0 where the map has none."""
    return 0 if found.status is None else block[found.status.register - first]


def other(order: WordOrder) -> WordOrder:
    return "low_first" if order == "high_first" else "high_first"


def sane(values: Sequence[float], largest: float) -> bool:
    """Whether all may be weights of a cell that bears `largest` (the same unit)."""
    return all(
        math.isfinite(value) and abs(value) <= largest and (value == 0.0 or abs(value) >= SMALLEST * largest)
        for value in values
    )
