"""What an ODrive says of its owner by CANSimple: its serial number, in messages that the driver never asks for."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.ports.can_frame import frame_of
from drivers.ports.transcript import Chunk

TELLING = {0x04: "RxSdo", 0x05: "TxSdo", 0x06: "Address"}
"""odrive-cansimple-0.6.10.dbc: Address has Serial_Number, and an SDO may read it."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    """As they are. Raises ValueError where a message is among them that may hold the serial number."""
    for chunk in chunks:
        frame = frame_of(chunk.data)
        if not frame.extended and frame.id & 0x1F in TELLING:
            raise ValueError(f"the frame {frame} may be {TELLING[frame.id & 0x1F]}, which may hold the serial number")
    return list(chunks)
