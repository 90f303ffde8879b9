"""Frames of a Modbus RTU slave: requests of eight bytes out of what came, answers with their checksum.

Source: Modbus over serial line V1.02: CRC-16, polynomial 0xA001 reflected, start 0xFFFF, low byte first; a frame ends
with 3.5 characters of silence; a frame with a wrong CRC or another address is not answered.
"""

from __future__ import annotations

import struct
from math import inf

FRAME = 8
"""bytes of a request to read registers, or to write one."""
GAP = 0.05
"""s of silence after which half a frame is forgotten. 3.5 characters at 9600 baud are 4 ms; a pty has no line to keep
bytes together, so the gap allows for the host's scheduling."""


def crc16(data: bytes) -> int:
    """Modbus CRC; sent low byte first."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc


def framed(body: bytes) -> bytes:
    """An answer with its CRC, low byte first."""
    return body + struct.pack("<H", crc16(body))


class Requests:
    """Bytes in any portions -> whole requests."""

    def __init__(self) -> None:
        self._buffer = b""
        self._heard = -inf

    def feed(self, data: bytes, t: float) -> list[bytes]:
        """What came at t (s); the requests that are complete with it."""
        if t - self._heard > GAP:
            self._buffer = b""
        self._heard = t
        self._buffer += data
        found = []
        while len(self._buffer) >= FRAME:
            if crc16(self._buffer[:FRAME]) != 0:  # a frame with its own CRC appended leaves 0
                self._buffer = self._buffer[1:]
                continue
            found.append(self._buffer[:FRAME])
            self._buffer = self._buffer[FRAME:]
        return found
