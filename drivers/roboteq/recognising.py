"""How a Roboteq controller is recognised: by queries alone. A `!` command, whichever, would let a motor go on that its
watchdog has stopped (controller.py), and an end of line alone would carry out half a command that somebody left."""

from __future__ import annotations

from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe
from drivers.roboteq.lines import OPEN_LOOP, Answer, Decoder, Refused, Text, encode


def _hear(_line: Line) -> Found | None:
    """It says nothing by itself."""
    return None


def _ask(line: Line) -> Found | None:
    firmware = _text(line, "FID")
    if firmware is None and line.answers:  # the first question may have met half a line of somebody else
        firmware = _text(line, "FID")
    if firmware is None:
        return None
    model = _text(line, "TRN")
    watchdog, mode = _number(line, "~RWD"), _number(line, "~MMOD")
    poles, pulses, volts = _number(line, "~BPOL"), _number(line, "~EPPR"), _number(line, "?V", 1)
    untold = {
        "nominal_bus_voltage": "V of the supply; the command is a share of it"
        + (f" ({volts / 10:g} V measured now)" if volts is not None else ""),
        "rotation": f'"brushless" (BPOL = {poles}), "encoder" (EPPR = {pulses}) or "none"',
    }
    keys: dict[str, object] = {"watchdog_timeout": watchdog / 1e3} if watchdog else {}
    return Found(
        "roboteq",
        firmware if model is None else f"{model}, {firmware}",
        "motor",
        keys,
        untold,
        (_mode(mode), f"pole pairs (BPOL) {poles}, encoder pulses (EPPR) {pulses}"),
        "sends nothing until it is asked; 50 rows/s fit 115200 baud",
        _watchdog(watchdog),
    )


def _mode(mode: int | None) -> str:
    if mode == OPEN_LOOP:
        return "open loop (MMOD 0): the command is a share of the supply voltage"
    return f"mode {mode} (MMOD) closes a loop: set '^MMOD 1 0' and save it with '%EESAV', or the rig refuses it"


def _watchdog(milliseconds: int | None) -> str:
    if milliseconds is None:
        return "not told (~RWD is not answered)"
    if milliseconds == 0:
        return "SWITCHED OFF (RWD = 0): set '^RWD 500' and save it with '%EESAV', or the rig refuses it"
    return (
        f"{milliseconds / 1e3:g} s (RWD, read from it); fed by ! commands, the next of which lets the motor go on"
        " (manual V2.1); the rig measures it before it arms"
    )


def _text(line: Line, name: str) -> str | None:
    answer = _asked(line, f"?{name}", name)
    return answer.text if isinstance(answer, Text) else None


def _number(line: Line, query: str, place: int = 0) -> int | None:
    """One of the values of an answer, that of channel 1 unless another `place` is named."""
    answer = _asked(line, query, query[1:])
    return answer.values[min(place, len(answer.values) - 1)] if isinstance(answer, Answer) else None


def _asked(line: Line, query: str, name: str) -> Answer | Text | None:
    def answers(data: bytes) -> list[Answer | Text]:
        return [each for each in Decoder().feed(data) if isinstance(each, Answer | Text) and each.name == name]

    def enough(data: bytes) -> bool:
        return bool(answers(data)) or any(isinstance(each, Refused) for each in Decoder().feed(data))

    return next(iter(answers(line.ask(encode(query), enough))), None)


PROBE = SerialProbe(
    rates=(Rate(115200), Rate(9600), Rate(57600), Rate(38400), Rate(19200)),
    asks="?FID, ?TRN, ~RWD, ~MMOD, ~BPOL, ~EPPR, ?V (queries alone)",
    hear=_hear,
    ask=_ask,
)
"""115200 8N1 is the factory's (manual V2.1, serial operation)."""
