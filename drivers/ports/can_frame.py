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


def frame_of(text: bytes) -> Frame:
    """The frame that `str` wrote, as transcripts of a bus have it. Raises ValueError for what is none."""
    identifier, mark, data = text.decode("ascii").partition("#")
    if not mark or len(identifier) not in (3, 8):
        raise ValueError(f"a frame is written as 917#01 02 or 00000917#01 02, not {text!r}")
    return Frame(int(identifier, 16), len(identifier) == 8, bytes.fromhex(data))
