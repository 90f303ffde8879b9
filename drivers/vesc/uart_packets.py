"""Packets of the VESC motor controller on a serial port (UART or USB): bytes to SI and back. Pure.

Source: github.com/vedderb/bldc at b9d287b (firmware 7.01): comm/packet.c (framing), util/crc.c, comm/commands.c,
datatypes.h. `02 length payload crc crc 03`, CRC-16 XMODEM over the payload, all integers big endian. The firmware
multiplies in float32 and truncates toward zero.
"""

from __future__ import annotations

import binascii
import struct
from typing import NamedTuple

from drivers.vesc.can_frames import CURRENT_SCALE, DUTY_SCALE, GET_VALUES_SELECTIVE

SHORT, END = 0x02, 0x03
FW_VERSION, SET_DUTY, SET_CURRENT = 0, 5, 6
"""datatypes.h, COMM_PACKET_ID."""
OVERHEAD = 5
"""Bytes of a short packet beside its payload."""
FIELDS = ">hhiihihB"
"""FET and motor temperature, motor and input current, duty, ERPM, input voltage, fault."""
MASK = 1 << 0 | 1 << 1 | 1 << 2 | 1 << 3 | 1 << 6 | 1 << 7 | 1 << 8 | 1 << 15
"""commands.c: the bits of these fields in COMM_GET_VALUES_SELECTIVE."""
VALUES_BYTES = 5 + struct.calcsize(FIELDS)
"""Payload of the reply: command, mask, fields."""
LONGEST = 255
"""Of a payload with one byte of length."""
NEWEST = 30
"""Major number of a firmware that is believed; it is 7 at the time of writing."""
LONGEST_REPLY = 100
"""Of what is asked for here, with room for newer firmware: a length that was spoilt must not be waited for."""


class Firmware(NamedTuple):
    """The reply to FW_VERSION."""

    major: int
    minor: int
    hardware: str
    uuid: str
    """Hexadecimal; empty from old firmware."""


class Values(NamedTuple):
    """The reply to GET_VALUES_SELECTIVE with `MASK`. The currents are means since the last such reply."""

    fet_temperature: float
    """degC"""
    motor_temperature: float
    """degC"""
    current: float
    """A in the motor, positive while it takes power."""
    input_current: float
    """A"""
    duty: float
    erpm: int
    bus_voltage: float
    """V"""
    fault: int


class Unreadable(NamedTuple):
    """Bytes that are no packet, or a packet that was not asked for."""

    data: bytes


Record = Firmware | Values | Unreadable


def crc16(data: bytes) -> int:
    """CRC-16 XMODEM: 0x31C3 for the digits 1 to 9 (crc.c)."""
    return binascii.crc_hqx(data, 0)


def framed(payload: bytes) -> bytes:
    """A packet. Raises ValueError for an empty payload or one of more than 255 bytes."""
    if not 1 <= len(payload) <= LONGEST:
        raise ValueError(f"a short VESC packet has 1 to {LONGEST} bytes, not {len(payload)}")
    return bytes((SHORT, len(payload))) + payload + struct.pack(">HB", crc16(payload), END)


def set_duty(duty: float) -> bytes:
    """`duty` -1 ... 1 of the bus voltage."""
    return framed(struct.pack(">Bi", SET_DUTY, round(duty * DUTY_SCALE)))


def set_current(amperes: float) -> bytes:
    return framed(struct.pack(">Bi", SET_CURRENT, round(amperes * CURRENT_SCALE)))


def ask_firmware() -> bytes:
    """Feeds no timeout."""
    return framed(bytes((FW_VERSION,)))


def ask_values() -> bytes:
    """Feeds no timeout; resets the means of the currents."""
    return framed(struct.pack(">BI", GET_VALUES_SELECTIVE, MASK))


def decode(payload: bytes) -> Record:
    """One payload. Never raises."""
    match payload[0]:
        case 0 if len(payload) >= 3:
            name, _, rest = payload[3:].partition(b"\0")
            return Firmware(payload[1], payload[2], name.decode("ascii", "backslashreplace"), rest[:12].hex())
        case 50 if len(payload) == VALUES_BYTES and int.from_bytes(payload[1:5], "big") == MASK:
            fet, motor, current, supply, duty, erpm, volts, fault = struct.unpack(FIELDS, payload[5:])
            return Values(
                fet / 10.0, motor / 10.0, current / 100.0, supply / 100.0, duty / 1000.0, erpm, volts / 10.0, fault
            )
    return Unreadable(payload)


def _awaited(begun: bytes) -> bool:
    """Whether a reply may begin so. What looks like a beginning in the midst of a spoilt packet mostly may not, and
    nobody waits for the rest of it."""
    if len(begun) < 4:
        return True
    length, command, first = begun[1:4]
    if command == FW_VERSION:
        return 1 <= first <= NEWEST
    return command == GET_VALUES_SELECTIVE and length == VALUES_BYTES


class Decoder:
    """Bytes in any portions -> records. After bytes that are no packet it goes on one byte later, as packet.c does."""

    def __init__(self) -> None:
        self._rest = b""
        self._skipped = b""

    def feed(self, data: bytes) -> list[Record]:
        self._rest += data
        records: list[Record] = []
        while self._rest:
            length = self._packet()
            if length is None:
                break
            if length:
                self._flush(records)
                records.append(decode(self._rest[2 : length - 3]))
            else:
                length = 1
                self._skipped += self._rest[:1]
            self._rest = self._rest[length:]
        if not self._rest or len(self._skipped) >= LONGEST:
            self._flush(records)
        return records

    def _flush(self, records: list[Record]) -> None:
        if self._skipped:
            records.append(Unreadable(self._skipped))
        self._skipped = b""

    def _packet(self) -> int | None:
        """Bytes of the packet that begins here; 0: none does; None: it is not whole yet."""
        rest = self._rest
        if rest[0] != SHORT:
            return 0
        if len(rest) < 2:
            return None
        length = rest[1] + OVERHEAD
        if not 1 <= rest[1] <= LONGEST_REPLY:
            return 0
        if len(rest) < length:
            return None if _awaited(rest) else 0
        good = rest[length - 1] == END and crc16(rest[2 : length - 3]) == int.from_bytes(rest[length - 3 : length - 1])
        return length if good else 0
