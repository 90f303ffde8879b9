"""How devices on CANopen are recognised: by their heartbeats, and by objects that are read; none is written.

An unasked question goes only to nodes whose heartbeat was heard. On a bus of ODrives the identifier of an SDO request
(0x600 + node) is a command to one of the axes 48 to 51; every node is asked only where the operator names the kind.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.canopen.frames import HEARTBEAT, NMT_STATES, SDO_REPLY, SDO_REQUEST, as_heartbeat, service
from drivers.canopen.state402 import state_of
from drivers.ports.can_frame import Frame
from drivers.recognition.can_traffic import CanProbe, Traffic
from drivers.recognition.found import Found

LAST_NODE = 127
UPLOAD = 0x40
"""Initiate SDO upload; an expedited reply has 0x43, 0x47, 0x4B or 0x4F and up to four bytes (CiA 301, 7.2.4.3)."""
EXPEDITED = {0x43: 4, 0x47: 3, 0x4B: 2, 0x4F: 1}
SERVICES = frozenset((0x080, 0x180, 0x280, 0x380, 0x480, 0x580))
Number = Callable[[int, int], int | None]
"""`number(index, sub)` of one node; None: it does not answer, or has no such object."""


def owns(frame: Frame) -> bool:
    """A heartbeat has one byte, what else a device sends by itself up to eight."""
    if frame.extended or not frame.id & 0x7F:
        return False
    return len(frame.data) == 1 if service(frame) == HEARTBEAT else service(frame) in SERVICES


def beating(traffic: Traffic) -> dict[int, int]:
    """Node -> NMT state of its last heartbeat."""
    heard: dict[int, int] = {}
    for _, frame in traffic.frames:
        if owns(frame) and service(frame) == HEARTBEAT and (beat := as_heartbeat(frame)) is not None:
            heard[frame.id & 0x7F] = beat.state
    return {node: state for node, state in heard.items() if state in NMT_STATES}


def _read(traffic: Traffic, nodes: list[int], index: int, sub: int) -> dict[int, int]:
    """Node -> value of an object of at most four bytes."""
    place = bytes((index & 0xFF, index >> 8, sub))
    requests = [Frame(SDO_REQUEST + node, False, bytes((UPLOAD, *place, 0, 0, 0, 0))) for node in nodes]
    values = {}
    for frame in traffic.ask(requests, 0.1):
        size = EXPEDITED.get(frame.data[0]) if len(frame.data) == 8 else None
        if not frame.extended and service(frame) == SDO_REPLY and size and frame.data[1:4] == place:
            values[frame.id & 0x7F] = int.from_bytes(frame.data[4 : 4 + size], "little")
    return values


def _asking(profile: int, made: Callable[[int, str, str, Number], Found]) -> Callable[[Traffic], list[Found]]:
    def ask(traffic: Traffic) -> list[Found]:
        states = beating(traffic)
        nodes = list(range(1, LAST_NODE + 1)) if traffic.named else sorted(states)
        types = _read(traffic, nodes, 0x1000, 0) if nodes else {}
        mine = [node for node, kind in sorted(types.items()) if kind & 0xFFFF == profile]
        return [_found(traffic, node, states, made) for node in mine]

    return ask


def _found(
    traffic: Traffic, node: int, states: dict[int, int], made: Callable[[int, str, str, Number], Found]
) -> Found:
    def number(index: int, sub: int) -> int | None:
        return _read(traffic, [node], index, sub).get(node)

    words = ("vendor", "product", "revision", "serial")
    known = [f"{word} 0x{value:X}" for sub, word in enumerate(words, 1) if (value := number(0x1018, sub))]
    identity = ", ".join([f"CANopen node {node}", *known])
    period = number(0x1017, 0)
    beats = f"heartbeat every {period} ms" if period else "no heartbeat (0x1017 is 0, as delivered)"
    told = f"{beats}; {NMT_STATES[states[node]]}" if node in states else beats
    return made(node, identity, told, number)


def _watchdog(number: Number) -> str:
    consumer = number(0x1016, 1)
    now = f"waits {consumer & 0xFFFF} ms for node {consumer >> 16 & 0x7F}" if consumer else "off, as delivered"
    return f"heartbeat consumer (0x1016): {now}; the rig writes it at opening, reads it back and measures it"


def _drive(node: int, identity: str, told: str, number: Number) -> Found:
    status, mode = number(0x6041, 0), number(0x6061, 0)
    state = None if status is None else state_of(status)
    settings = (f"state: {state if state is not None else 'not told'}; mode of operation (0x6061) {mode}",)
    untold = {
        "max_voltage": "V, largest command",
        "rate_per_volt": "rev/s of the propeller for 1 V (mode velocity; torque_per_volt in mode torque)",
        "watchdog_timeout": "s without our heartbeat after which it stops; the rig writes it",
    }
    return Found("cia402", identity, "motor", {"node_id": node}, untold, settings, told, _watchdog(number))


def _output(node: int, identity: str, told: str, number: Number) -> Found:
    outputs = number(0x6411, 0)
    untold = {
        "watchdog_timeout": "s without our heartbeat after which it stops; the rig writes it",
        "max_voltage": "V that the amplifier behind the output takes",
    }
    settings = (f"{outputs} analogue outputs (0x6411)" if outputs else "no analogue output of 16 bits (0x6411)",)
    return Found("cia401", identity, "motor", {"node_id": node}, untold, settings, told, _watchdog(number))


def _cell(node: int, identity: str, told: str, number: Number) -> Found:
    inputs = number(0x6130, 0) or number(0x9130, 0) or number(0x7130, 0)
    untold = {"rate": "rows/s", "sign": "1 or -1: -1 where forward thrust reads negative"}
    return Found("cia404", identity, "force", {"node_id": node}, untold, (f"{inputs} inputs",), told)


def _hear(_traffic: Traffic) -> list[Found]:
    """A heartbeat does not say of which profile a device is."""
    return []


ASKS = "nodes whose heartbeat is heard, all where the kind is named: objects 0x1000, 0x1018 and settings are read"
DRIVE = CanProbe(ASKS, owns, _hear, _asking(402, _drive))
OUTPUT = CanProbe(ASKS, owns, _hear, _asking(401, _output))
CELL = CanProbe(ASKS, owns, _hear, _asking(404, _cell))
