"""A transmitter on a pty, scripted: registers as a table, answers as bytes. Shares no code with the drivers."""

from __future__ import annotations

from collections.abc import Callable


def crc(data: bytes) -> bytes:
    """The data with its checksum (MODBUS over serial line 1.02, 6.2.2)."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return data + value.to_bytes(2, "little")


class Transmitter:
    """The script of a Peer without terminator. `spoil` may change each answer; b"": says nothing."""

    def __init__(self, registers: dict[int, int], function: int = 3, address: int = 1) -> None:
        self.registers, self.function, self.address = registers, function, address
        self.spoil: Callable[[bytes], bytes] = lambda reply: reply
        self.asked: list[tuple[int, int]] = []
        self._rest = b""

    def __call__(self, peer, data: bytes) -> None:
        self._rest += data
        while len(self._rest) >= 8:
            frame, self._rest = self._rest[:8], self._rest[8:]
            assert crc(frame[:-2]) == frame
            register, count = int.from_bytes(frame[2:4], "big"), int.from_bytes(frame[4:6], "big")
            self.asked.append((register, count))
            if frame[0] == self.address:
                peer.send(self.spoil(self.answer(frame[1], register, count)))

    def answer(self, function: int, register: int, count: int) -> bytes:
        wanted = range(register, register + count)
        if function != self.function or any(each not in self.registers for each in wanted):
            return crc(bytes((self.address, function | 0x80, 1 if function != self.function else 2)))
        words = b"".join(self.registers[each].to_bytes(2, "big") for each in wanted)
        return crc(bytes((self.address, function, len(words))) + words)
