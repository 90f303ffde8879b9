"""One frame of a CAN bus, whatever adapter brought it."""

from __future__ import annotations

from typing import NamedTuple


class Frame(NamedTuple):
    """An identifier of 11 bits, or of 29 where it is `extended`, and up to 8 bytes."""

    id: int
    extended: bool
    data: bytes

    def __str__(self) -> str:
        return f"{self.id:08X}#{self.data.hex(' ')}" if self.extended else f"{self.id:03X}#{self.data.hex(' ')}"
