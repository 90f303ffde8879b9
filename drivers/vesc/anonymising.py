"""What a VESC says of its owner: its UUID.

On CAN in long replies, which the driver never asks for; on UART in the reply to FW_VERSION.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivers.ports.anonymous import changed
from drivers.ports.can_frame import frame_of
from drivers.ports.transcript import Chunk
from drivers.vesc.uart_packets import FW_VERSION, OVERHEAD, SHORT, framed

UUID_BYTES = 12
LONG_REPLIES = (5, 6, 7)
"""datatypes.h: FILL_RX_BUFFER, FILL_RX_BUFFER_LONG, PROCESS_RX_BUFFER."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    """As they are. Raises ValueError where a long reply is among them: it may be that of FW_VERSION, with the UUID."""
    for chunk in chunks:
        frame = frame_of(chunk.data)
        if frame.extended and frame.id >> 8 in LONG_REPLIES:
            raise ValueError(f"the frame {frame} is part of a long reply, which may hold the UUID")
    return list(chunks)


def anonymise_uart(chunks: Sequence[Chunk]) -> list[Chunk]:
    """UUIDs count from 1, their checksums are made anew."""
    return changed(chunks, "<", _without_uuids)


def _without_uuids(data: bytes) -> bytes:
    names: dict[bytes, bytes] = {}
    out, at = b"", 0
    while at < len(data):
        whole = data[at : at + data[at + 1] + OVERHEAD] if data[at] == SHORT and at + 1 < len(data) else b""
        payload = whole[2:-3]
        if payload and payload[0] == FW_VERSION and framed(payload) == whole:
            head, mark, rest = payload[3:].partition(b"\0")
            uuid = rest[:UUID_BYTES]
            name = names.setdefault(uuid, (len(names) + 1).to_bytes(len(uuid), "big")) if uuid else b""
            out += framed(payload[:3] + head + mark + name + rest[UUID_BYTES:])
            at += len(whole)
        else:
            out += data[at : at + 1]
            at += 1
    return out
