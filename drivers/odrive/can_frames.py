"""Frames of ODrive's CANSimple protocol: numbers to bytes and back.

Source: ODrive, odrive-cansimple-0.6.10.dbc and -0.5.6.dbc (both in PyPI's odrive-can 2.1.0), and for 0.5
Firmware/communication/can/can_simple.cpp. Standard identifiers, node << 5 | command; little endian, IEEE float32.
Commands are sent with all eight bytes, which other people's devices insist on and ODrive accepts.
"""

from __future__ import annotations

import struct
from math import isfinite
from typing import NamedTuple

from drivers.ports.can_frame import Frame
from drivers.protocols import measured

HEARTBEAT, SET_AXIS_STATE, ENCODER, SET_MODE = 0x01, 0x07, 0x09, 0x0B
SET_VELOCITY, SET_TORQUE, IQ, TEMPERATURE, BUS, CLEAR_ERRORS = 0x0D, 0x0E, 0x14, 0x15, 0x17, 0x18
IDLE, CLOSED_LOOP = 1, 8
"""AxisState."""
TORQUE_CONTROL, VELOCITY_CONTROL = 1, 2
"""ControlMode."""
PASSTHROUGH = 1
"""InputMode: the set-point is taken as it is."""
STATES = {
    0: "undefined", 1: "idle", 2: "start-up sequence", 3: "full calibration", 4: "motor calibration",
    6: "encoder index search", 7: "encoder offset calibration", 8: "closed loop control", 9: "lock-in spin",
    10: "encoder direction search", 11: "homing", 12: "encoder hall polarity calibration",
    13: "encoder hall phase calibration", 14: "anticogging calibration",
}  # fmt: skip
ERRORS_06 = {
    0x1: "initializing", 0x2: "system level", 0x4: "timing error", 0x8: "missing estimate", 0x10: "bad config",
    0x20: "DRV fault", 0x40: "missing input", 0x100: "DC bus over voltage", 0x200: "DC bus under voltage",
    0x400: "DC bus over current", 0x800: "DC bus over regen current", 0x1000: "current limit violation",
    0x2000: "motor over temperature", 0x4000: "inverter over temperature", 0x8000: "velocity limit violation",
    0x10000: "position limit violation", 0x1000000: "watchdog timer expired", 0x2000000: "estop requested",
    0x4000000: "spinout detected", 0x8000000: "brake resistor disarmed", 0x10000000: "thermistor disconnected",
    0x40000000: "calibration error",
}  # fmt: skip
"""Axis errors of firmware 0.6."""
ERRORS_05 = {
    0x1: "invalid state", 0x40: "motor failed", 0x80: "sensorless estimator failed", 0x100: "encoder failed",
    0x200: "controller failed", 0x800: "watchdog timer expired", 0x1000: "min endstop pressed",
    0x2000: "max endstop pressed", 0x4000: "estop requested", 0x20000: "homing without endstop",
    0x40000: "over temperature", 0x80000: "unknown position",
}  # fmt: skip
"""Axis errors of firmware 0.5 (AxisError of odrive_enums.h)."""
WATCHDOG = {"0.6": 0x1000000, "0.5": 0x800}
PARTS_05 = ("motor", "encoder", "controller")
"""Bytes 5 to 7 of a heartbeat of firmware 0.5: one of their errors is set."""


class Heartbeat(NamedTuple):
    """What the axis says of itself; `parts` are bytes 5 to 7, whose meaning depends on the firmware."""

    error: int
    state: int
    parts: tuple[int, int, int]


class Encoder(NamedTuple):
    """rev, rev/s"""

    position: float
    velocity: float


class Iq(NamedTuple):
    """A, of the motor: wanted and measured."""

    setpoint: float
    measured: float


class Temperature(NamedTuple):
    """degC"""

    fet: float
    motor: float


class Bus(NamedTuple):
    """V, A of the supply."""

    voltage: float
    current: float


class NotUnderstood(NamedTuple):
    """A frame of the node that is none of these, or too short."""

    frame: Frame


Record = Heartbeat | Encoder | Iq | Temperature | Bus | NotUnderstood
_PAIRS: dict[int, type[Encoder | Iq | Temperature | Bus]] = {
    ENCODER: Encoder, IQ: Iq, TEMPERATURE: Temperature, BUS: Bus,
}  # fmt: skip


def decode(frame: Frame) -> Record:
    """A frame of the node. Never raises."""
    command, data = frame.id & 0x1F, frame.data
    if frame.extended or len(data) < 8:
        return NotUnderstood(frame)
    if command == HEARTBEAT:
        return Heartbeat(int.from_bytes(data[:4], "little"), data[4], (data[5], data[6], data[7]))
    if kind := _PAIRS.get(command):
        first, second = struct.unpack("<ff", data[:8])
        return kind(measured(first), measured(second))
    return NotUnderstood(frame)


def _frame(node: int, command: int, data: bytes) -> Frame:
    return Frame(node << 5 | command, False, data.ljust(8, b"\0"))


def set_velocity(node: int, velocity: float) -> Frame:
    """rev/s. Raises ValueError for what is no number."""
    return _frame(node, SET_VELOCITY, struct.pack("<ff", _number(velocity), 0.0))


def set_torque(node: int, torque: float) -> Frame:
    """N.m. Raises ValueError for what is no number."""
    return _frame(node, SET_TORQUE, struct.pack("<f", _number(torque)))


def _number(value: float) -> float:
    if not isfinite(value):
        raise ValueError(f"an ODrive set-point is a number, not {value}")
    return value


def set_mode(node: int, control: int, input_mode: int) -> Frame:
    return _frame(node, SET_MODE, struct.pack("<II", control, input_mode))


def set_state(node: int, state: int) -> Frame:
    return _frame(node, SET_AXIS_STATE, struct.pack("<I", state))


def clear_errors(node: int) -> Frame:
    """All errors are forgotten; moves nothing, the axis stays idle."""
    return _frame(node, CLEAR_ERRORS, b"")


def errors(heartbeat: Heartbeat, firmware: str) -> str:
    """What is wrong, in words; empty: nothing."""
    known = ERRORS_06 if firmware == "0.6" else ERRORS_05
    words = [name for bit, name in known.items() if heartbeat.error & bit]
    if unknown := heartbeat.error & ~sum(known):
        words.append(f"0x{unknown:X}")
    if firmware == "0.5":
        words += [f"{part} error" for part, flag in zip(PARTS_05, heartbeat.parts, strict=True) if flag]
    return ", ".join(words)
