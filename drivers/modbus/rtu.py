"""Modbus RTU, the half that asks: requests to bytes, bytes to replies. No port, no clock, no thread.

Source: MODBUS application protocol 1.1b3 (6.3, 6.4: functions 3 and 4; 7: exceptions) and MODBUS over serial line 1.02
(2.5.1.1: silence between frames; 6.2.2: CRC). A reply has no number that says which request it answers: there is one
request at a time, and what comes while none is waiting is no reply.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Literal, NamedTuple

REQUEST_CHARACTERS = 8
"""Address, function, register, count, CRC."""
REPLY_OVERHEAD = 5
"""Characters of a reply beside its registers; an exception has as many in all."""
MOST_REGISTERS = 125
"""In one request (6.3)."""
GAP_CHARACTERS = 3.5
LEAST_GAP = 1.75e-3
"""s: the silence between two frames is 3.5 characters, above 19200 baud always this long (2.5.1.1)."""
FIXED_GAP_ABOVE = 19_200
KEPT = 1024
"""Bytes in which a reply is looked for; the longest has 255."""
EXCEPTIONS = {
    1: "function not supported", 2: "no such register", 3: "value refused", 4: "device failure",
    5: "acknowledged, still at work", 6: "busy", 8: "memory parity error", 10: "gateway has no path",
    11: "device behind the gateway does not answer",
}  # fmt: skip
"""Codes of section 7."""


class Registers(NamedTuple):
    """What was asked for: one 16-bit word a register, from `register` on."""

    words: tuple[int, ...]
    register: int


class Refusal(NamedTuple):
    """An exception reply."""

    code: int

    def __str__(self) -> str:
        return f"exception {self.code} ({EXCEPTIONS.get(self.code, 'unknown')})"


class Unreadable(NamedTuple):
    """Bytes that are no reply to what was asked."""

    text: str


Record = Registers | Refusal | Unreadable


@dataclass(frozen=True, slots=True)
class Read:
    """`count` registers from `register` on, which is the number on the wire: 0 for 40001 and for 30001."""

    address: int
    function: Literal[3, 4]
    register: int
    count: int

    def __post_init__(self) -> None:
        if not 1 <= self.address <= 247:
            raise ValueError(f"Modbus address must be 1 to 247, not {self.address}")
        if not 1 <= self.count <= MOST_REGISTERS:
            raise ValueError(f"a Modbus request is for 1 to {MOST_REGISTERS} registers, not {self.count}")
        if not 0 <= self.register <= 0x10000 - self.count:
            raise ValueError(f"Modbus registers {self.register} to {self.register + self.count - 1} are not 0 to 65535")

    def encode(self) -> bytes:
        return framed(struct.pack(">BBHH", self.address, self.function, self.register, self.count))

    @property
    def reply_characters(self) -> int:
        return REPLY_OVERHEAD + 2 * self.count


def crc16(data: bytes) -> int:
    """CRC of 6.2.2; 0 over a frame with its own CRC at the end."""
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ _TABLE[(crc ^ byte) & 0xFF]
    return crc


def _step(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value


_TABLE = tuple(_step(value) for value in range(256))


def framed(body: bytes) -> bytes:
    """A frame with its CRC, low byte first."""
    return body + crc16(body).to_bytes(2, "little")


def gap(baud: int, bits: int) -> float:
    """S of silence that end a frame; `bits` per character."""
    return LEAST_GAP if baud > FIXED_GAP_ABOVE else GAP_CHARACTERS * bits / baud


class Decoder:
    """Bytes in any portions -> the reply to the one request that waits."""

    def __init__(self) -> None:
        self._asked: Read | None = None
        self._rest = b""

    @property
    def waiting(self) -> bool:
        return self._asked is not None

    def expect(self, request: Read | None) -> None:
        """From now on `request` is what is answered; None: nothing is. What came before is forgotten."""
        self._rest = b""
        self._asked = request

    def feed(self, data: bytes) -> list[Record]:
        asked = self._asked
        if asked is None:
            return [Unreadable(f"bytes that answer nothing: {shown(data)}")] if data else []
        self._rest = (self._rest + data)[-KEPT:]
        for at in range(len(self._rest) - REPLY_OVERHEAD + 1):
            found, length = _reply(self._rest, at, asked)
            if found is not None:
                beside = self._rest[:at] + self._rest[at + length :]
                self.expect(None)
                return [Unreadable(f"bytes beside a reply: {shown(beside)}"), found] if beside else [found]
        return []

    def unanswered(self) -> str:
        """Why the request that waits has no reply, as far as the bytes tell."""
        rest, asked = self._rest, self._asked
        if not rest or asked is None:
            return "no reply"
        if len(rest) < REPLY_OVERHEAD or crc16(rest) != 0:
            return f"a reply whose checksum is wrong: {shown(rest)}"
        if rest[0] != asked.address:
            return f"a reply of address {rest[0]} to a request to {asked.address}: {shown(rest)}"
        return f"a reply to something else: {shown(rest)}"


def _reply(data: bytes, at: int, asked: Read) -> tuple[Registers | Refusal | None, int]:
    """The reply that begins at `at`, and its length; None where there is none, or not all of it."""
    if data[at] != asked.address:
        return None, 0
    length = asked.reply_characters
    if data[at + 1] == asked.function and data[at + 2] == 2 * asked.count and len(data) >= at + length:
        frame = data[at : at + length]
        if crc16(frame) == 0:
            return Registers(struct.unpack(f">{asked.count}H", frame[3:-2]), asked.register), length
    if data[at + 1] == asked.function | 0x80 and crc16(data[at : at + REPLY_OVERHEAD]) == 0:
        return Refusal(data[at + 2]), REPLY_OVERHEAD
    return None, 0


def shown(data: bytes) -> str:
    """The first bytes as hexadecimal."""
    return data[:20].hex(" ") + (" ..." if len(data) > 20 else "")
