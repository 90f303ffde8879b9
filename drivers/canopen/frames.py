"""Frames of CANopen beside SDO: which service an identifier is of, heartbeats, emergencies, packed values. Pure.

Source: CiA 301 (predefined connection set, NMT, EMCY, heartbeat), as in canopen 2.4 `nmt.py`, `emcy.py`, `pdo/base.py`.
All integers are little endian.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from drivers.ports.can_frame import Frame

NMT, SYNC, EMERGENCY, SDO_REPLY, SDO_REQUEST, HEARTBEAT = 0x000, 0x080, 0x080, 0x580, 0x600, 0x700
"""Function codes: added to the node's identifier. NMT and SYNC stand alone."""
SEND_PDO = (0x180, 0x280, 0x380, 0x480)
"""TPDO 1 to 4, sent by the device."""
RECEIVE_PDO = (0x200, 0x300, 0x400, 0x500)
"""RPDO 1 to 4, sent to the device."""
START, STOP, PRE_OPERATIONAL = 0x01, 0x02, 0x80
"""NMT commands."""
BOOTED, OPERATIONAL = 0x00, 0x05
NMT_STATES = {BOOTED: "just started", 0x04: "stopped", OPERATIONAL: "operational", 0x7F: "pre-operational"}
HEARTBEAT_LOST = 0x8130
"""Emergency of a device whose master fell silent."""
EMERGENCIES = (
    (0x1000, 0xFF00, "generic"),
    (0x2000, 0xF000, "current"),
    (0x3000, 0xF000, "voltage"),
    (0x4000, 0xF000, "temperature"),
    (0x5000, 0xFF00, "hardware"),
    (0x6000, 0xF000, "software"),
    (0x7000, 0xF000, "sensors and modules"),
    (0x8000, 0xF000, "monitoring"),
    (0x9000, 0xFF00, "external"),
    (0xF000, 0xF000, "of its own"),
)
"""Code, mask, what kind of error it is (CiA 301, table of emergency error codes)."""


class Heartbeat(NamedTuple):
    """NMT state of a node, 0 when it has just booted."""

    state: int


class Emergency(NamedTuple):
    """`code` 0: an error is over. `register`: the error register that goes with it."""

    code: int
    register: int

    def __str__(self) -> str:
        kind = next((words for code, mask, words in EMERGENCIES if self.code & mask == code), "of unknown kind")
        return f"0x{self.code:04X} ({kind}), error register 0x{self.register:02X}"


def service(frame: Frame) -> int:
    """Function code of a frame: its identifier without the node's."""
    return frame.id & 0x780


def nmt(command: int, node_id: int) -> Frame:
    return Frame(NMT, False, bytes((command, node_id)))


def heartbeat(node_id: int) -> Frame:
    """The master's own: it is operational."""
    return Frame(HEARTBEAT + node_id, False, bytes((OPERATIONAL,)))


def as_heartbeat(frame: Frame) -> Heartbeat | None:
    """None: it is none. The highest bit toggles in node guarding and is left out."""
    return Heartbeat(frame.data[0] & 0x7F) if len(frame.data) == 1 else None


def as_emergency(frame: Frame) -> Emergency | None:
    """None: it is none."""
    return Emergency(int.from_bytes(frame.data[:2], "little"), frame.data[2]) if len(frame.data) == 8 else None


@dataclass(frozen=True, slots=True)
class Field:
    """One object of a device's dictionary, and how many bits it has."""

    index: int
    sub: int
    bits: int
    signed: bool = False

    @property
    def mapping(self) -> int:
        """As it is written to a mapping parameter."""
        return self.index << 16 | self.sub << 8 | self.bits


def pack(fields: tuple[Field, ...], values: tuple[int, ...]) -> bytes:
    """Values in the order of the fields. Raises ValueError for a value that its field cannot carry."""
    data = b""
    for field, value in zip(fields, values, strict=True):
        try:
            data += value.to_bytes(field.bits // 8, "little", signed=field.signed)
        except OverflowError:
            raise ValueError(f"object 0x{field.index:04X} has {field.bits} bits, too few for {value}") from None
    return data


def unpack(fields: tuple[Field, ...], data: bytes) -> tuple[int, ...] | None:
    """Values in the order of the fields; None: the frame is not so long."""
    if len(data) != sum(field.bits for field in fields) // 8:
        return None
    values, at = [], 0
    for field in fields:
        end = at + field.bits // 8
        values.append(int.from_bytes(data[at:end], "little", signed=field.signed))
        at = end
    return tuple(values)
