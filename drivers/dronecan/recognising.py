"""How DroneCAN's nodes are recognised: by what they send. Nothing is asked: NodeStatus goes out once a second.

Source: 341.NodeStatus.uavcan (uptime in s 32 bits, health 2, mode 3, sub mode 3, vendor status 16; one frame). Which
ESC a node is, its Status says, in several frames: they are put together by the library of the extra `dronecan`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

from drivers.dronecan.options import HEALTH, MODES
from drivers.ports.can_frame import Frame
from drivers.recognition.can_traffic import CanProbe, Traffic
from drivers.recognition.found import Found

NODE_STATUS, STATUS = 341, 1034
OTHERS = 0x10000
"""Extended identifiers below it are VESC's."""
STATUS_BYTES = 8
"""Of a NodeStatus: seven and the tail."""


def owns(frame: Frame) -> bool:
    return frame.extended and frame.id >= OTHERS and bool(frame.data)


def hear(traffic: Traffic) -> list[Found]:
    """Nodes that tell their state and that of an ESC."""
    states: dict[int, Frame] = {}
    status: dict[int, list[Frame]] = defaultdict(list)
    for _, frame in traffic.frames:
        if owns(frame) and not frame.id & 0x80:
            kind, node = frame.id >> 8 & 0xFFFF, frame.id & 0x7F
            if kind == NODE_STATUS and len(frame.data) == STATUS_BYTES:
                states[node] = frame
            elif kind == STATUS:
                status[node].append(frame)
    return [_found(node, states[node], status[node], traffic.heard_for) for node in sorted(states) if status[node]]


def _found(node: int, state: Frame, status: list[Frame], seconds: float) -> Found:
    uptime, bits = int.from_bytes(state.data[:4], "little"), state.data[4]
    health, mode = bits >> 6, bits >> 3 & 7
    rate = sum(frame.data[-1] >> 7 for frame in status) / seconds
    untold = {
        "max_voltage": "V, largest command",
        "full_voltage": "V for which all that the ESC gives is sent: the supply's, as a rule",
        "watchdog_timeout": "s after the last command until the ESC stops, as set in it",
    }
    try:
        indices = sorted(set(_indices(status)))
    except ModuleNotFoundError:
        indices = []
        untold["esc_index"] = "which ESC it says it is: pip install 'thruster-rig[dronecan]', and look again"
    keys: dict[str, object] = {"node_id": node, "rate": float(f"{rate:.2g}")}
    return Found(
        "dronecan_esc",
        f"DroneCAN node {node}" + (f", ESC {', '.join(map(str, indices))}" if indices else ""),
        "motor",
        keys | ({"esc_index": indices[0]} if indices else {}),
        untold,
        (f"health {HEALTH[health]}, {MODES.get(mode, f'in mode {mode}')}, up for {uptime} s",),
        f"esc.Status {rate:.2g}/s",
        "cannot be asked, and some ESCs have none; it is proved before each campaign, with the propeller turning",
    )


def _indices(status: Iterable[Frame]) -> Iterator[int]:
    from drivers.dronecan.transfers import Assembler, Received

    assembler = Assembler()
    for frame in status:
        transfer = assembler.feed(frame)
        if isinstance(transfer, Received):
            yield int(transfer.value.esc_index)


PROBE = CanProbe(asks="nothing", owns=owns, hear=hear)
