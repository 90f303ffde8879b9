"""Bytes of a VESC as its firmware makes them.

Source: github.com/vedderb/bldc (firmware 6/7): comm/comm_can.c, comm/commands.c, util/buffer.c, util/crc.c,
datatypes.h. All integers are big endian. The firmware is compiled with -fsingle-precision-constant: value x scale is
a float32 product and the cast truncates toward zero (0.253 x 1000 -> 252), so does `scaled` here.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from sim_devices.wires.can_frame import CanFrame

# CAN_PACKET_ID, datatypes.h
SET_DUTY, SET_CURRENT, SET_CURRENT_BRAKE, SET_RPM, SET_POS = 0, 1, 2, 3, 4
FILL_RX_BUFFER, FILL_RX_BUFFER_LONG, PROCESS_RX_BUFFER, PROCESS_SHORT_BUFFER = 5, 6, 7, 8
STATUS, STATUS_4, STATUS_5 = 9, 16, 27
SET_CURRENT_REL, SET_CURRENT_BRAKE_REL = 10, 11
PING, PONG, SHUTDOWN = 17, 18, 31
# COMM_PACKET_ID, datatypes.h
COMM_FW_VERSION, COMM_GET_VALUES, COMM_SET_DUTY, COMM_SET_CURRENT, COMM_SET_CURRENT_BRAKE = 0, 4, 5, 6, 7
COMM_SET_RPM, COMM_ALIVE, COMM_GET_VALUES_SELECTIVE = 8, 30, 50
ALL_VALUES = 0x3FFFFF
"""22 fields of GET_VALUES."""
FIRMWARE = (6, 5)
HARDWARE_NAME = b"SIM 60"
HARDWARE_TYPE_VESC = 0


@dataclass(frozen=True, slots=True)
class Telemetry:
    """What a VESC measures, in its own units."""

    erpm: float = 0.0
    """electrical rev/min."""
    current: float = 0.0
    """A in the motor, positive when it takes power, whatever the direction."""
    duty: float = 0.0
    """-1..1"""
    input_current: float = 0.0
    """A."""
    bus_voltage: float = 0.0
    """V."""
    fet_temperature: float = 0.0
    """degC."""
    motor_temperature: float = 0.0
    """degC."""
    i_d: float = 0.0
    i_q: float = 0.0
    v_d: float = 0.0
    v_q: float = 0.0
    """A and V in the rotor's frame; q carries the sign of the direction."""
    charge: float = 0.0
    """A h taken."""
    charge_back: float = 0.0
    energy: float = 0.0
    """W h taken."""
    energy_back: float = 0.0
    tachometer: int = 0
    """counts, 6 per electrical revolution, signed."""
    tachometer_abs: int = 0
    position: float = 0.0
    """deg."""
    fault: int = 0
    controller_id: int = 0
    timed_out: bool = False


def scaled(value: float, scale: float, bits: int) -> int:
    """(int)(value x scale) in float32, truncated toward zero, clipped to a signed integer of `bits`."""
    limit = (1 << (bits - 1)) - 1
    number = int(np.float32(value) * np.float32(scale))
    return min(max(number, -limit - 1), limit)


def _i16(value: float, scale: float) -> bytes:
    return struct.pack(">h", scaled(value, scale, 16))


def _i32(value: float, scale: float) -> bytes:
    return struct.pack(">i", scaled(value, scale, 32))


def status(t: Telemetry, vesc_id: int) -> CanFrame:
    """STATUS: ERPM, motor current x10, duty x1000."""
    return CanFrame(STATUS << 8 | vesc_id, _i32(t.erpm, 1) + _i16(t.current, 10) + _i16(t.duty, 1000))


def status_4(t: Telemetry, vesc_id: int) -> CanFrame:
    """STATUS_4: temperatures x10, input current x10, position x50."""
    body = _i16(t.fet_temperature, 10) + _i16(t.motor_temperature, 10) + _i16(t.input_current, 10)
    return CanFrame(STATUS_4 << 8 | vesc_id, body + _i16(t.position, 50))


def status_5(t: Telemetry, vesc_id: int) -> CanFrame:
    """STATUS_5: tachometer counts, V_in x10, reserved."""
    body = struct.pack(">i", _wrapped(t.tachometer)) + _i16(t.bus_voltage, 10)
    return CanFrame(STATUS_5 << 8 | vesc_id, body + b"\0\0")


def _wrapped(count: int) -> int:
    return (count + 0x80000000) % 0x100000000 - 0x80000000


def values(t: Telemetry, mask: int = ALL_VALUES) -> bytes:
    """The fields of GET_VALUES whose bit is in `mask`, without the leading command byte."""
    fet = _i16(t.fet_temperature, 10)
    fields = (
        fet,
        _i16(t.motor_temperature, 10),
        _i32(t.current, 100),
        _i32(t.input_current, 100),
        _i32(t.i_d, 100),
        _i32(t.i_q, 100),
        _i16(t.duty, 1000),
        _i32(t.erpm, 1),
        _i16(t.bus_voltage, 10),
        _i32(t.charge, 1e4),
        _i32(t.charge_back, 1e4),
        _i32(t.energy, 1e4),
        _i32(t.energy_back, 1e4),
        struct.pack(">i", _wrapped(t.tachometer)),
        struct.pack(">i", _wrapped(t.tachometer_abs)),
        bytes((t.fault,)),
        _i32(t.position, 1e6),
        bytes((t.controller_id,)),
        fet * 3,
        _i32(t.v_d, 1000),
        _i32(t.v_q, 1000),
        bytes((int(t.timed_out),)),
    )
    return b"".join(field for bit, field in enumerate(fields) if mask >> bit & 1)


def firmware_version(serial: bytes) -> bytes:
    """The reply to FW_VERSION: version, name, 12-byte UUID, pairing, test version, hardware type, custom configs."""
    return bytes((COMM_FW_VERSION, *FIRMWARE)) + HARDWARE_NAME + b"\0" + serial + b"\0\0" + bytes((0, 0))


def crc16(data: bytes) -> int:
    """XMODEM: polynomial 0x1021, start 0 (util/crc.c); 0x31C3 for the nine digits 1 to 9."""
    crc = 0
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def buffer_frames(payload: bytes, to: int, sender: int) -> list[CanFrame]:
    """Frames of a reply addressed to `to`: one short frame, or pieces and a checksum (comm_can.c)."""
    if len(payload) <= 6:
        return [CanFrame(PROCESS_SHORT_BUFFER << 8 | to, bytes((sender, 1)) + payload)]
    frames, at = [], 0
    while at < len(payload) and at < 256:  # offset in one byte: 0, 7 ... 252
        frames.append(CanFrame(FILL_RX_BUFFER << 8 | to, bytes((at,)) + payload[at : at + 7]))
        at += 7
    while at < len(payload):
        frames.append(CanFrame(FILL_RX_BUFFER_LONG << 8 | to, struct.pack(">H", at) + payload[at : at + 6]))
        at += 6
    end = struct.pack(">BBHH", sender, 1, len(payload), crc16(payload))
    return [*frames, CanFrame(PROCESS_RX_BUFFER << 8 | to, end)]
