"""How a SCPI supply is recognised: by questions alone, where its kind is named, as any word feeds a watchdog that a
supply may have. Other instruments speak SCPI as well: it must have an output that is on or off, and measure a voltage.
"""

from __future__ import annotations

from drivers.ports.lines import LineCutter, printable
from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe
from drivers.scpi.lines import encode, number

SECOND = 1.0
"""An answer may take that long."""


def _hear(_line: Line) -> Found | None:
    """It says nothing by itself."""
    return None


def _answer(line: Line, question: str) -> str | None:
    said = line.ask(encode(question), lambda came: b"\n" in came, SECOND)
    lines = [printable(each).strip() for each in LineCutter().feed(said)]
    return lines[0] if len(lines) == 1 else None


def _number(line: Line, question: str) -> float | None:
    answer = _answer(line, question)
    return None if answer is None else number(answer)


def _ask(line: Line) -> Found | None:
    """Twice who it is: the first question may have met half a line of somebody else."""
    identity = _answer(line, "*IDN?") or (_answer(line, "*IDN?") if line.answers else None)
    if identity is None or identity.count(",") < 2:
        return None
    output, measured = _number(line, "OUTP?"), _number(line, "MEAS:VOLT?")
    if output not in (0.0, 1.0) or measured is None:
        return None
    volts, amps = _number(line, "VOLT?"), _number(line, "CURR?")
    return Found(
        "scpi_supply",
        identity,
        "motor",
        {},
        {
            "max_voltage": "V, largest command; the supply gives none below 0",
            "current_limit": "A, set and read back at opening",
        },
        (
            f"output {'on' if output else 'off'}, {measured:g} V measured",
            f"set: {_said(volts, 'V')}, {_said(amps, 'A')}",
        ),
        "sends nothing until it is asked",
        "most supplies have none: without watchdog_timeout and watchdog_settings the rig does not arm it",
    )


def _said(value: float | None, unit: str) -> str:
    return f"{unit} not told" if value is None else f"{value:g} {unit}"


PROBE = SerialProbe(
    rates=(Rate(9600), Rate(115200)),
    asks="*IDN?, OUTP?, MEAS:VOLT?, VOLT?, CURR? (questions alone)",
    hear=_hear,
    ask=_ask,
    named_only=True,
)
