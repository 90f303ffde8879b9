"""Device side of DroneCAN's wire: bits of DSDL, transfers of frames, the checksum of long ones.

Source: DroneCAN specification, "CAN bus transport layer" and "Data structure description language": values are little
endian in bytes, whose bits go out from the highest; what is left of a value fills the next byte from its top. A
transfer longer than 7 bytes begins with a CRC-16 (CCITT, from FFFF) over the type's signature and the payload.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from sim_devices.wires.can_frame import CanFrame

NODE_STATUS, RAW_COMMAND, RPM_COMMAND, STATUS, ARMING_STATUS = 341, 1030, 1031, 1034, 1100
GET_NODE_INFO, ALLOCATION = 1, 1
SIGNATURES = {
    "Status": 0xA9AF28AEA2FBB254,
    "RawCommand": 0x217F5C87D7EC951D,
    "RPMCommand": 0xCE0F9F621CF7E70B,
    "GetNodeInfo": 0xEE468A8121C46A9E,
}
"""Of the data types whose transfers may be long."""


def checksum(data: bytes, value: int = 0xFFFF) -> int:
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ 0x1021 if value & 0x8000 else value << 1) & 0xFFFF
    return value


class Bits:
    """Values of any width, one after the other."""

    def __init__(self) -> None:
        self._value, self._width = 0, 0

    def add(self, value: int, width: int) -> Bits:
        value &= (1 << width) - 1
        while width > 0:
            part = min(8, width)
            self._value = self._value << part | value & (1 << part) - 1
            self._width += part
            value >>= part
            width -= part
        return self

    def half(self, value: float) -> Bits:
        """A float16."""
        return self.add(int.from_bytes(struct.pack("<e", value), "little"), 16)

    def bytes(self) -> bytes:
        pad = -self._width % 8
        return (self._value << pad).to_bytes((self._width + pad) // 8, "big")


def signed(data: bytes, width: int) -> list[int]:
    """As many signed values of `width` bits as are in an array that ends the message."""
    total, values = int.from_bytes(data, "big"), []
    for index in range(len(data) * 8 // width):
        chunk = total >> (len(data) * 8 - (index + 1) * width) & (1 << width) - 1
        value, place, left = 0, 0, width
        while left > 0:
            part = min(8, left)
            value |= (chunk >> (left - part) & (1 << part) - 1) << place
            place += part
            left -= part
        values.append(value - (1 << width) if value >> (width - 1) else value)
    return values


class Heard(NamedTuple):
    """A whole transfer. `request`: a question of a service."""

    data_type: int
    source: int
    destination: int | None
    request: bool
    number: int
    data: bytes


def message_id(data_type: int, source: int, priority: int = 16) -> int:
    return priority << 24 | data_type << 8 | source


def answer_id(service: int, source: int, destination: int, priority: int = 16) -> int:
    return priority << 24 | service << 16 | destination << 8 | 0x80 | source


def frames(identifier: int, data: bytes, number: int, signature: int = 0) -> list[CanFrame]:
    """A transfer's frames; those of more than one begin with the checksum."""
    if len(data) > 7:
        crc = checksum(data, checksum(signature.to_bytes(8, "little")))
        data = crc.to_bytes(2, "little") + data
    parts = [data[at : at + 7] for at in range(0, len(data), 7)] or [b""]
    made = []
    for index, part in enumerate(parts):
        tail = number & 0x1F | (index % 2) << 5 | (index == len(parts) - 1) << 6 | (index == 0) << 7
        made.append(CanFrame(identifier, part + bytes([tail])))
    return made


class Ear:
    """Whole transfers of single and many frames. Those with a wrong checksum or order are dropped, as a node does."""

    def __init__(self) -> None:
        self._begun: dict[int, tuple[int, bytes]] = {}

    def hear(self, frame: CanFrame) -> Heard | None:
        if not frame.extended or frame.remote or not frame.data:
            return None
        tail, begun = frame.data[-1], self._begun.pop(frame.id, None)
        start, end = bool(tail & 0x80), bool(tail & 0x40)
        if start:
            expected, data = tail & 0x1F, b""
        elif begun is not None and begun[0] == tail & 0x3F:
            expected, data = begun[0] & 0x1F, begun[1]
        else:
            return None
        data += frame.data[:-1]
        if not end:
            self._begun[frame.id] = (expected | (tail & 0x20 ^ 0x20), data)
            return None
        whole = data if start else self._checked(frame.id, data)
        return None if whole is None else _heard(frame.id, tail & 0x1F, whole)

    @staticmethod
    def _checked(identifier: int, data: bytes) -> bytes | None:
        """Without its checksum; None where that is wrong, or the type is none that an ESC takes in many frames."""
        name = {RAW_COMMAND: "RawCommand", RPM_COMMAND: "RPMCommand"}.get(identifier >> 8 & 0xFFFF)
        if name is None:
            return None
        crc = checksum(data[2:], checksum(SIGNATURES[name].to_bytes(8, "little")))
        return data[2:] if crc == int.from_bytes(data[:2], "little") else None


def _heard(identifier: int, number: int, data: bytes) -> Heard:
    source = identifier & 0x7F
    if identifier & 0x80:
        destination, request = identifier >> 8 & 0x7F, bool(identifier & 0x8000)
        return Heard(identifier >> 16 & 0xFF, source, destination, request, number, data)
    return Heard(identifier >> 8 & 0xFFFF, source, None, False, number, data)
