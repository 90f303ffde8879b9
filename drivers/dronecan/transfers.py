"""Transfers of DroneCAN from frames and back, by the library's own framing and DSDL; no node, bus or thread of it.

Source: dronecan 1.0.27, dronecan/transport.py (Transfer.to_frames, from_frames) with the DSDL of its dsdl_specs. An
identifier has priority << 24 | data type << 8 | source node, or in a service (bit 7) data type << 16 | request << 15 |
destination << 8; each frame ends with start, end, toggle and the transfer's number.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from dronecan import UAVCANException, uavcan
from dronecan.transport import Frame as LibraryFrame
from dronecan.transport import Transfer

from drivers.ports.can_frame import Frame

NODE_STATUS, RAW_COMMAND, RPM_COMMAND, STATUS, ARMING_STATUS = 341, 1030, 1031, 1034, 1100
"""Default data type identifiers of messages."""
GET_NODE_INFO = 1
"""Of a service."""
START, END, SERVICE = 0x80, 0x40, 0x80
LONGEST = 64
"""Frames of a transfer that are kept; GetNodeInfo with all it may have is 54."""
COMMAND_PRIORITY, STATE_PRIORITY, ASKING_PRIORITY = 8, 24, 30
"""0 is the most urgent of 32."""


class Received(NamedTuple):
    """A whole transfer: what kind, from whom, and the library's value."""

    data_type: int
    source: int
    service: bool
    number: int
    value: Any


class NotUnderstood(NamedTuple):
    """Frames that make no transfer, and why."""

    frame: Frame
    why: str


def source_of(frame: Frame) -> int:
    return frame.id & 0x7F


def is_message(frame: Frame, *data_types: int) -> bool:
    """A message of one of these types, of a node that has an identifier."""
    message = frame.extended and not frame.id & SERVICE and source_of(frame) != 0
    return message and frame.id >> 8 & 0xFFFF in data_types


def is_answer(frame: Frame, data_type: int, source: int, destination: int) -> bool:
    wanted = data_type << 16 | destination << 8 | SERVICE | source
    return frame.extended and frame.id & 0xFFFFFF == wanted


def is_anonymous(frame: Frame) -> bool:
    """A node without an identifier asks for one (1.Allocation); of priority 0 there is none of those, but VESC's."""
    return frame.extended and frame.id & 0x3FF == 1 << 8 and frame.id >> 24 != 0


class Assembler:
    """Frames in the order of their arrival make transfers; one at a time of each identifier."""

    def __init__(self) -> None:
        self._begun: dict[int, list[Frame]] = {}

    def feed(self, frame: Frame) -> Received | NotUnderstood | None:
        """The transfer that this frame completes; None: there is more to come. Never raises."""
        if not frame.data:
            return NotUnderstood(frame, "it has no tail byte")
        tail = frame.data[-1]
        kept = [] if tail & START else self._begun.pop(frame.id, None)
        if kept is None:
            return NotUnderstood(frame, "the beginning of its transfer is missing")
        lost = self._begun.pop(frame.id, None)
        kept.append(frame)
        if tail & END:
            return decode(kept)
        if len(frame.data) < 8 or len(kept) > LONGEST:
            return NotUnderstood(frame, "a frame that more follow is not full, or too many follow")
        self._begun[frame.id] = kept
        return NotUnderstood(lost[0], "the end of its transfer is missing") if lost else None


def decode(frames: list[Frame]) -> Received | NotUnderstood:
    """What these frames say together. Never raises."""
    transfer = Transfer()
    try:
        transfer.from_frames([LibraryFrame(frame.id, frame.data) for frame in frames])
    except (UAVCANException, ValueError, IndexError) as error:  # IndexError: shorter than its CRC or array
        return NotUnderstood(frames[-1], str(error))
    return Received(
        transfer.data_type_id, transfer.source_node_id, transfer.service_not_message, transfer.transfer_id,
        transfer.payload,
    )  # fmt: skip


class Sender:
    """Transfers of one node, each kind with its own running number."""

    def __init__(self, node: int) -> None:
        self._node = node
        self._numbers: dict[int, int] = {}

    def raw_command(self, values: list[int]) -> list[Frame]:
        return self._message(uavcan.equipment.esc.RawCommand(cmd=values), RAW_COMMAND, COMMAND_PRIORITY)

    def rpm_command(self, values: list[int]) -> list[Frame]:
        return self._message(uavcan.equipment.esc.RPMCommand(rpm=values), RPM_COMMAND, COMMAND_PRIORITY)

    def arming_status(self, *, armed: bool) -> list[Frame]:
        value = uavcan.equipment.safety.ArmingStatus(status=255 if armed else 0)
        return self._message(value, ARMING_STATUS, STATE_PRIORITY)

    def node_status(self, uptime: int) -> list[Frame]:
        """In order and operational, for `uptime` s."""
        return self._message(uavcan.protocol.NodeStatus(uptime_sec=uptime), NODE_STATUS, STATE_PRIORITY)

    def ask_node_info(self, destination: int) -> list[Frame]:
        """The node is asked who it is."""
        transfer = Transfer(
            payload=uavcan.protocol.GetNodeInfo.Request(), source_node_id=self._node, dest_node_id=destination,
            transfer_id=self._number(-destination), transfer_priority=ASKING_PRIORITY, service_not_message=True,
            request_not_response=True,
        )  # fmt: skip
        return _ours(transfer)

    def _message(self, value: Any, data_type: int, priority: int) -> list[Frame]:
        transfer = Transfer(
            payload=value, source_node_id=self._node, transfer_id=self._number(data_type), transfer_priority=priority
        )
        return _ours(transfer)

    def _number(self, key: int) -> int:
        number = self._numbers.get(key, 0)
        self._numbers[key] = (number + 1) % 32
        return number


def _ours(transfer: Transfer) -> list[Frame]:
    return [Frame(frame.message_id, True, bytes(frame.bytes)) for frame in transfer.to_frames()]


def text(value: Any) -> str:
    """An array of bytes as printable text."""
    return bytes(value).decode("ascii", "replace")
