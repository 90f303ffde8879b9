"""How ODrive axes are recognised on CAN: by what they send. Nothing is asked: heartbeats are on as delivered."""

from __future__ import annotations

from collections import defaultdict

from drivers.odrive.can_frames import BUS, ENCODER, HEARTBEAT, IQ, STATES, TEMPERATURE, Bus, Heartbeat, decode
from drivers.ports.can_frame import Frame
from drivers.recognition.can_traffic import CanProbe, Traffic
from drivers.recognition.found import Found

KEYS = {
    HEARTBEAT: "heartbeat_rate",
    ENCODER: "rate",
    IQ: "current_rate",
    BUS: "supply_rate",
    TEMPERATURE: "thermal_rate",
}
SENT = frozenset(KEYS)
LEAST = 2
"""Heartbeats of one node that are believed."""


def owns(frame: Frame) -> bool:
    return not frame.extended and len(frame.data) == 8 and frame.id & 0x1F in SENT


def hear(traffic: Traffic) -> list[Found]:
    """Nodes with heartbeats of a known state and one message more: an emergency of CANopen looks like a heartbeat."""
    counts: dict[int, dict[int, int]] = defaultdict(lambda: defaultdict(int))
    states: dict[int, Heartbeat] = {}
    volts: dict[int, float] = {}
    for _, frame in traffic.frames:
        if not owns(frame):
            continue
        node = frame.id >> 5
        counts[node][frame.id & 0x1F] += 1
        match decode(frame):
            case Heartbeat() as heartbeat:
                states[node] = heartbeat
            case Bus(voltage, _):
                volts[node] = voltage
    mine = [node for node in sorted(states) if counts[node][HEARTBEAT] >= LEAST and len(counts[node]) > 1]
    return [
        _found(node, states[node], counts[node], volts.get(node), traffic.heard_for)
        for node in mine
        if states[node].state in STATES
    ]


def _found(node: int, last: Heartbeat, counts: dict[int, int], volts: float | None, seconds: float) -> Found:
    rates = {key: float(f"{counts.get(command, 0) / seconds:.2g}") for command, key in KEYS.items()}
    missing = [key for key in ("rate", "current_rate", "supply_rate") if not rates[key]]
    settings = [f"axis state: {STATES[last.state]}, error 0x{last.error:X}"]
    settings += [f"supply {volts:.4g} V"] if volts is not None else []
    settings += [f"sends nothing for {', '.join(missing)}: set its ..._msg_rate_ms"] if missing else []
    return Found(
        "odrive_can", f"ODrive axis, CAN node {node}", "motor", {"node_id": node, **rates},
        {
            "max_voltage": "V, largest command",
            "rate_per_volt": "rev/s for 1 V (mode velocity; torque_per_volt in mode torque)",
            "watchdog_timeout": "s, config.watchdog_timeout with enable_watchdog",
            "firmware": '"0.6" or "0.5"',
        },
        tuple(settings), ", ".join(f"{key} {rate:g}/s" for key, rate in rates.items() if rate),
        "cannot be asked over CANSimple; off as delivered; it disarms the axis; the rig measures it before it arms",
    )  # fmt: skip


PROBE = CanProbe(asks="nothing", owns=owns, hear=hear)
