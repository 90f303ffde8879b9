"""What frames of a VESC say of its owner: its UUID, in long replies alone, which the driver never asks for."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.ports.can_frame import frame_of
from drivers.ports.transcript import Chunk

LONG_REPLIES = (5, 6, 7)
"""datatypes.h: FILL_RX_BUFFER, FILL_RX_BUFFER_LONG, PROCESS_RX_BUFFER."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    """As they are. Raises ValueError where a long reply is among them: it may be that of FW_VERSION, with the UUID."""
    for chunk in chunks:
        frame = frame_of(chunk.data)
        if frame.extended and frame.id >> 8 in LONG_REPLIES:
            raise ValueError(f"the frame {frame} is part of a long reply, which may hold the UUID")
    return list(chunks)
