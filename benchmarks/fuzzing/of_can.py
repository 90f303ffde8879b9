"""Decoders of CAN frames: sound frames of each, as four bytes of identifier and the data, and what is asked of it."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dronecan import uavcan

from drivers.can_signals.signals import CanSignals
from drivers.can_signals.signals import Options as SignalOptions
from drivers.canopen import frames
from drivers.canopen.state402 import next_controlword, state_of
from drivers.dronecan import transfers
from drivers.dronecan.esc import row_of
from drivers.odrive import can_frames as odrive_frames
from drivers.ports.can_frame import Frame
from drivers.ports.inbox import BadRecords, Inbox
from drivers.ports.slcan_lines import SlcanLines
from drivers.protocols import LinkHealth
from drivers.vesc import can_frames as vesc_frames

Decode = Callable[[bytes], Any]
EXTENDED = 1 << 31
"""In the four bytes of an identifier: it has 29 bits."""
SLCAN = (b"t1003010203\r", b"T00000917800000000000000001234\r", b"z\r", b"V1013\r", b"\a", b"r1002\r")
DBC = """VERSION ""
BU_: CELL
BO_ 2147484672 TORQUE: 8 CELL
 SG_ torque : 0|32@1- (0.001,0) [-100|100] "N.m" CELL
 SG_ temperature : 32|16@1- (0.1,-40) [0|0] "degC" CELL
 SG_ which M : 48|8@1+ (1,0) [0|3] "" CELL
BO_ 257 SCALED: 8 CELL
 SG_ real : 0|32@1- (1,0) [0|0] "N" CELL
 SG_ other : 39|32@0- (1e6,-1) [0|0] "N" CELL
SIG_VALTYPE_ 257 real : 1;
SIG_VALTYPE_ 257 other : 1;
"""
MAP = """title = "a cell"
source = "of its own making"
dbc = "cell.dbc"
rates = {TORQUE = 100.0, SCALED = 50.0}
channels.torque = {signal = "TORQUE.torque", unit = "N.m"}
channels.real = {signal = "SCALED.real", unit = "N"}
channels.other = {signal = "SCALED.other", unit = "N", scale = 1e3}
"""


def _sound(identifier: int, data: bytes) -> bytes:
    return struct.pack(">I", identifier) + data


VESC = tuple(
    _sound(packet << 8 | 7 | EXTENDED, data)
    for packet, data in (
        (9, bytes(8)), (16, bytes(8)), (27, bytes(8)), (18, b"\x07"), (8, bytes([7, 0, 51, 0, 0, 4, 0, 1])),
    )
)  # fmt: skip
ODRIVE = tuple(
    _sound(3 << 5 | command, data)
    for command, data in (
        (0x01, struct.pack("<IBBBB", 0x1000000, 8, 0, 1, 0)), (0x09, struct.pack("<ff", 1.0, -12.5)),
        (0x14, struct.pack("<ff", 2.0, 1.5)), (0x17, struct.pack("<ff", 48.0, 0.5)),
        (0x15, b"\0\0\x80\x7f\0\0\x80\xff"),
    )
)  # fmt: skip
CANOPEN = tuple(
    _sound(service | 7, data)
    for service, data in (
        (frames.EMERGENCY, bytes.fromhex("30 81 11 00 00 00 00 00")), (frames.HEARTBEAT, b"\x05"),
        (frames.SEND_PDO[0], bytes.fromhex("37 02 00 00 80 7f 00")), (frames.SEND_PDO[1], bytes(4)),
    )
)  # fmt: skip
SIGNALS = (_sound(0x400 | EXTENDED, bytes(8)), _sound(257, struct.pack("<ff", 1.5, 0.0)))


def _frame(data: bytes) -> Frame:
    number = int.from_bytes(data[:4], "big")
    long = bool(number & EXTENDED)
    return Frame(number & (0x1FFFFFFF if long else 0x7FF), long, data[4:12])


class _Bus:
    """Where a driver reads; what is put on it is there at once, and nobody hears what is sent."""

    alive, error = True, None

    def __init__(self, first: list[Frame]) -> None:
        self._first = first

    def subscribe(self, match: Callable[[Frame], bool]) -> Inbox[Frame]:
        self.match, self.inbox = match, Inbox[Frame](64)
        self.inbox.put([(0, frame) for frame in self._first])
        return self.inbox

    def unsubscribe(self, inbox: Inbox[Frame]) -> None:
        pass

    def health(self) -> LinkHealth:
        return LinkHealth(alive=True, received=0, bad=0, first_bad=(), error=None, dropped=0)


def decoders() -> dict[str, tuple[tuple[bytes, ...], Decode]]:
    """Name -> seeds and the decoder."""
    return {
        "VESC on CAN": (VESC, lambda data: vesc_frames.decode(_frame(data))),
        "ODrive": (ODRIVE, lambda data: odrive_frames.decode(_frame(data))),
        "CANopen": (CANOPEN, _canopen),
        "DroneCAN": (_dronecan_seeds(), _dronecan()),
        "signals of a DBC": (SIGNALS, _signals()),
        "slcan": (SLCAN, SlcanLines(BadRecords()).feed),
    }


FIELDS = (
    frames.Field(0x6041, 0, 16), frames.Field(0x606C, 0, 32, signed=True), frames.Field(0x6061, 0, 8, signed=True),
)  # fmt: skip


def _canopen(data: bytes) -> Any:
    """As drive and cell read a frame: heartbeat, emergency in words, values, the next controlword."""
    frame = _frame(data)
    values = frames.unpack(FIELDS, frame.data)
    state = state_of(values[0]) if values else None
    told = frames.as_emergency(frame)
    word = next_controlword(state, turning=True)
    return [frames.service(frame), frames.as_heartbeat(frame), str(told) if told else None, values, word]


def _dronecan_seeds() -> tuple[bytes, ...]:
    sender = transfers.Sender(9)
    status = uavcan.equipment.esc.Status(rpm=600, voltage=24.0, current=float("inf"), temperature=300.0)
    sent = [
        *sender.node_status(7), *sender.raw_command([0, 4000]), *sender.arming_status(armed=True),
        *sender._message(status, transfers.STATUS, transfers.STATE_PRIORITY),
    ]  # fmt: skip
    return tuple(_sound(frame.id | EXTENDED, frame.data) for frame in sent)


def _dronecan() -> Decode:
    assembler = transfers.Assembler()

    def decode(data: bytes) -> Any:
        got = assembler.feed(_frame(data))
        if isinstance(got, transfers.Received) and got.data_type == transfers.STATUS and not got.service:
            return row_of(got.value)
        return got

    return decode


def _signals() -> Decode:
    """The driver itself, on a bus of its own."""
    with TemporaryDirectory() as folder:
        Path(folder, "cell.dbc").write_text(DBC)
        Path(folder, "cell.toml").write_text(MAP)
        bus = _Bus([_frame(data) for data in SIGNALS])
        device = CanSignals("cell", SignalOptions("bus", str(Path(folder, "cell.toml"))), bus)  # type: ignore[arg-type]
        device.open()

    def decode(data: bytes) -> Any:
        frame = _frame(data)
        if bus.match(frame):
            bus.inbox.put([(0, frame)])
        return [list(sample.values) for sample in device.drain()]

    return decode
