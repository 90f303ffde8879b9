"""Packets of Pololu's serial controllers: command byte, data bytes of 7 bits, an optional CRC-7. Pure.

Source: Pololu, Maestro Servo Controller User's Guide (0J40), 5.c (compact and Pololu protocol), 5.d (CRC), 5.e (servo
commands), 4.b (errors). A command byte has bit 7 set, a data byte has not; the Pololu protocol puts 0xAA and a device
number before it and clears that bit. An answer is bare bytes: nothing but their number and order tells what it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

LEAD_IN = 0xAA
POLYNOMIAL = 0x91
"""Of the CRC-7, bits reversed (5.d)."""
SEVEN_BITS = 0x7F
KEPT = 64
"""Bytes that are shown of what answers nothing."""


def crc7(data: bytes) -> int:
    """The byte that follows a packet when CRC is enabled (5.d)."""
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value ^ POLYNOMIAL) >> 1 if value & 1 else value >> 1
    return value


def seven_bits(value: int) -> tuple[int, int]:
    """A number of 14 bits as two data bytes, the low one first. Raises ValueError beyond them."""
    if not 0 <= value < 1 << 14:
        raise ValueError(f"two data bytes carry 0 to 16383, not {value}")
    return value & SEVEN_BITS, value >> 7


@dataclass(frozen=True, slots=True)
class Packets:
    """How one device is spoken to."""

    device: int | None = None
    """Number in the Pololu protocol; None: compact protocol, for the only device on the line."""
    crc: bool = False

    def encode(self, command: int, *data: int) -> bytes:
        """One packet. Raises ValueError for what is no command byte or no data byte."""
        if not 0x80 <= command <= 0xFF or any(not 0 <= byte <= SEVEN_BITS for byte in data):
            raise ValueError(f"a packet is a byte from 0x80 on and bytes up to 0x7F, not {command:#x} and {data}")
        head = (command,) if self.device is None else (LEAD_IN, self.device, command & SEVEN_BITS)
        packet = bytes((*head, *data))
        return packet + bytes((crc7(packet),)) if self.crc else packet


class Answer(NamedTuple):
    """As many bytes as were asked for."""

    data: bytes

    @property
    def words(self) -> tuple[int, ...]:
        """Unsigned numbers of 16 bits, low byte first."""
        return tuple(self.data[i] | self.data[i + 1] << 8 for i in range(0, len(self.data) - 1, 2))


class Unreadable(NamedTuple):
    """Bytes that nobody asked for."""

    data: bytes


Record = Answer | Unreadable


class Decoder:
    """Bytes in any portions -> the one answer that is waited for, known by its length alone."""

    def __init__(self) -> None:
        self._wanted = 0
        self._rest = b""

    @property
    def waiting(self) -> bool:
        return self._wanted > 0

    def expect(self, length: int) -> bytes:
        """From now on `length` bytes are the answer; 0: nothing is. Returns what had come of the answer before."""
        rest, self._rest, self._wanted = self._rest, b"", length
        return rest

    def feed(self, data: bytes) -> list[Record]:
        if not data:
            return []
        if not self._wanted:
            return [Unreadable(data[:KEPT])]
        self._rest += data
        if len(self._rest) < self._wanted:
            return []
        answer, beside = self._rest[: self._wanted], self._rest[self._wanted :]
        self.expect(0)
        return [Answer(answer), Unreadable(beside[:KEPT])] if beside else [Answer(answer)]
