"""How VESCs are recognised on CAN: by their status messages, and by PING, which moves nothing and feeds no timeout."""

from __future__ import annotations

from collections import defaultdict

from drivers.ports.can_frame import Frame
from drivers.recognition.can_traffic import CanProbe, Traffic
from drivers.recognition.found import Found
from drivers.vesc.can_frames import PONG, STATUS, STATUS_4, STATUS_5, Pong, Status5, decode, ping

HOST = 250
"""Our identifier while we ask; VESC Tool's is 254."""
LAST_ID = 253
STATUSES = {
    STATUS: "STATUS",
    14: "STATUS_2",
    15: "STATUS_3",
    STATUS_4: "STATUS_4",
    STATUS_5: "STATUS_5",
    58: "STATUS_6",
}
"""datatypes.h, CAN_PACKET_ID -> name."""
NEEDED = (STATUS, STATUS_4, STATUS_5)
KEYS = {STATUS: "rate", STATUS_4: "thermal_rate", STATUS_5: "supply_rate"}
HARDWARE = {0: "VESC", 1: "VESC battery management", 2: "VESC custom hardware", None: "VESC"}


def owns(frame: Frame) -> bool:
    """Status messages have eight bytes and an identifier without anything above its command."""
    return frame.extended and frame.id >> 8 in (*STATUSES, PONG) and len(frame.data) in (1, 2, 8)


def hear(traffic: Traffic) -> list[Found]:
    """The VESCs whose status messages came."""
    return [_found(traffic, each, "VESC") for each in sorted(_senders(traffic))]


def ask(traffic: Traffic) -> list[Found]:
    """A ping to every identifier that was not heard: 253 frames of one byte, half a second."""
    known = _senders(traffic)
    answers = traffic.ask([ping(each, HOST) for each in range(LAST_ID + 1) if each not in known and each != HOST])
    pongs = {pong.vesc_id: pong for frame in answers if isinstance(pong := decode(frame), Pong)}
    return [_found(traffic, each, HARDWARE.get(pongs[each].hardware, "VESC")) for each in sorted(pongs)]


def _senders(traffic: Traffic) -> set[int]:
    return {frame.id & 0xFF for _, frame in traffic.frames if owns(frame) and frame.id >> 8 in STATUSES}


def _found(traffic: Traffic, vesc_id: int, hardware: str) -> Found:
    counts: dict[int, int] = defaultdict(int)
    volts = None
    for _, frame in traffic.frames:
        if owns(frame) and frame.id & 0xFF == vesc_id:
            counts[frame.id >> 8] += 1
            record = decode(frame)
            volts = record.bus_voltage if isinstance(record, Status5) else volts
    rates = {number: count / traffic.heard_for for number, count in counts.items() if number in STATUSES}
    untold = {
        "pole_pairs": "of the motor; a wrong one scales the rotation rate and nothing on the wire tells",
        "nominal_bus_voltage": "V; the duty is volts / this" + (f" ({volts:g} V measured now)" if volts else ""),
        "watchdog_timeout": "s, VESC Tool > App Settings > General > Timeout",
    }
    keys: dict[str, object] = {"vesc_id": vesc_id}
    keys |= {key: float(f"{rates.get(number, 0.0):.2g}") for number, key in KEYS.items() if rates}
    return Found(
        "vesc_can", f"{hardware}, CAN id {vesc_id}", "motor", keys, untold, _settings(rates), _rate(rates),
        "cannot be asked over CAN; factory 1 s (appconf_default.h), then it coasts and obeys the next SET command;"
        " the rig measures it before it arms",
    )  # fmt: skip


def _settings(rates: dict[int, float]) -> tuple[str, ...]:
    missing = [STATUSES[number] for number in NEEDED if number not in rates]
    if not missing:
        return ("sends the status messages that the rig needs",)
    return (
        f"sends no {', '.join(missing)}: tick them in VESC Tool, App Settings > General > CAN Status Messages"
        " (factory: all off)",
    )


def _rate(rates: dict[int, float]) -> str:
    told = [f"{STATUSES[number]} {rate:.2g}/s" for number, rate in sorted(rates.items())]
    return "sends " + ", ".join(told) if told else "sends nothing by itself"


PROBE = CanProbe(asks="PING to each identifier that is not heard", owns=owns, hear=hear, ask=ask)
