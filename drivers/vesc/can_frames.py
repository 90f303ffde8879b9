"""Frames of the VESC motor controller on CAN, mode "VESC" (29-bit identifiers): bytes to SI and back.

Source: github.com/vedderb/bldc at b9d287b (firmware 7.01): comm/comm_can.c, documentation/comm_can.md, datatypes.h,
applications/appconf_default.h. All integers big endian; identifier = command << 8 | vesc id. The firmware multiplies
in float32 and truncates toward zero, so its readings are on average half a count nearer to zero than the truth.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from drivers.ports.can_frame import Frame

SET_DUTY, SET_CURRENT, PROCESS_SHORT_BUFFER = 0, 1, 8
STATUS, STATUS_4, PING, PONG, STATUS_5 = 9, 16, 17, 18, 27
"""datatypes.h, CAN_PACKET_ID."""
GET_VALUES_SELECTIVE = 50
FAULT_MASK = 1 << 15
"""comm/commands.c: bit 15 of the selective mask is the fault code alone, and reading it resets no average."""
DUTY_SCALE, CURRENT_SCALE = 1e5, 1e3
"""comm_can.c: duty x 1e5, current in mA, both int32."""
FAULTS = {
    1: "over-voltage", 2: "under-voltage", 3: "gate driver", 4: "absolute over-current", 5: "over-temperature FET",
    6: "over-temperature motor", 7: "gate driver over-voltage", 8: "gate driver under-voltage",
    9: "microcontroller under-voltage", 10: "booted from watchdog reset", 11: "encoder SPI",
    18: "unbalanced currents", 28: "encoder", 31: "overspeed", 32: "underspeed",
}  # fmt: skip
"""datatypes.h, mc_fault_code; the ones a thruster meets."""


class Status(NamedTuple):
    """STATUS (9)."""

    erpm: int
    """Electrical revolutions per minute, signed."""
    current: float
    """A, motor"""
    duty: float
    """-1 ... 1, fraction of the bus voltage"""


class Status4(NamedTuple):
    """STATUS_4 (16)."""

    fet_temperature: float
    """degC"""
    motor_temperature: float
    """degC"""
    input_current: float
    """A"""
    position: float
    """degree, of the position controller"""


class Status5(NamedTuple):
    """STATUS_5 (27)."""

    tachometer: int
    """Counts, 6 per electrical revolution."""
    bus_voltage: float
    """V"""


class Pong(NamedTuple):
    """The answer to a ping: who is there."""

    vesc_id: int
    hardware: int | None
    """0 VESC, 1 battery management, 2 custom; None from old firmware, which does not say."""


class FaultCode(NamedTuple):
    """The fault that a VESC reports, 0 for none."""

    vesc_id: int
    code: int


class NotUnderstood(NamedTuple):
    """A frame that none of the others is."""

    frame: Frame


Record = Status | Status4 | Status5 | Pong | FaultCode | NotUnderstood


def set_duty(vesc_id: int, duty: float) -> Frame:
    """`duty` -1 ... 1 of the bus voltage."""
    return Frame(SET_DUTY << 8 | vesc_id, True, struct.pack(">i", round(duty * DUTY_SCALE)))


def set_current(vesc_id: int, amperes: float) -> Frame:
    """Exactly 4 bytes: from 6 on the firmware takes the first two for an off-delay."""
    return Frame(SET_CURRENT << 8 | vesc_id, True, struct.pack(">i", round(amperes * CURRENT_SCALE)))


def ping(vesc_id: int, host_id: int) -> Frame:
    """The frame that asks whether a VESC is there. It feeds no timeout."""
    return Frame(PING << 8 | vesc_id, True, bytes([host_id]))


def ask_fault(vesc_id: int, host_id: int) -> Frame:
    """GET_VALUES_SELECTIVE of the fault code in a short buffer (flag 0: process and reply). Feeds no timeout."""
    request = struct.pack(">BBBI", host_id, 0, GET_VALUES_SELECTIVE, FAULT_MASK)
    return Frame(PROCESS_SHORT_BUFFER << 8 | vesc_id, True, request)


def decode(frame: Frame) -> Record:
    """One frame from a VESC."""
    match frame.id >> 8, len(frame.data):
        case 9, 8:
            erpm, current, duty = struct.unpack(">ihh", frame.data)
            return Status(erpm, current / 10.0, duty / 1000.0)
        case 16, 8:
            fet, motor, supply, position = struct.unpack(">4h", frame.data)
            return Status4(fet / 10.0, motor / 10.0, supply / 10.0, position / 50.0)
        case 27, 8:
            counts, decivolts, _reserved = struct.unpack(">ihh", frame.data)
            return Status5(counts, decivolts / 10.0)
        case 18, 1 | 2:
            return Pong(frame.data[0], frame.data[1] if len(frame.data) == 2 else None)
        case 8, 8 if frame.data[2] == GET_VALUES_SELECTIVE:
            sender, _, _, mask, code = struct.unpack(">BBBIB", frame.data)
            return FaultCode(sender, code) if mask == FAULT_MASK else NotUnderstood(frame)
    return NotUnderstood(frame)
