"""What a CANopen device says of its owner: its serial number, object 0x1018 sub-index 4, in a reply of an SDO."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.canopen.frames import SDO_REPLY, service
from drivers.ports.can_frame import Frame, frame_of
from drivers.ports.transcript import Chunk

SERIAL = bytes.fromhex("18 10 04")
"""Index, low byte first, and sub-index, as bytes 1 to 3 of the reply have them."""
MAKERS = (0x1008, 0x1009, 0x100A)
"""Texts that are of the model: its name, its versions."""
UPLOADED, SEGMENTED = 0x43, 0x41
"""Four bytes in the reply itself; and a longer one, in frames that follow (CiA 301, 7.2.4.3)."""


def anonymise(chunks: Sequence[Chunk]) -> list[Chunk]:
    """Serial numbers count from 1. Raises ValueError where a text was read that is not the model's but a name, say."""
    names: dict[bytes, int] = {}
    return [chunk._replace(data=str(_renamed(frame_of(chunk.data), names)).encode()) for chunk in chunks]


def _renamed(frame: Frame, names: dict[bytes, int]) -> Frame:
    if frame.extended or service(frame) != SDO_REPLY or len(frame.data) != 8:
        return frame
    if frame.data[0] == SEGMENTED and int.from_bytes(frame.data[1:3], "little") not in MAKERS:
        raise ValueError(f"the frame {frame} begins a text of the device, and nobody knows what it says")
    if frame.data[0] != UPLOADED or frame.data[1:4] != SERIAL:
        return frame
    number = names.setdefault(frame.data[4:], len(names) + 1)
    return frame._replace(data=frame.data[:4] + number.to_bytes(4, "little"))
