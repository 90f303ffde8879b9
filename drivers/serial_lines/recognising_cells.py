"""How load cells that are asked in text are recognised: Loadstar's interfaces, and Mantracourt's cards where named."""

from __future__ import annotations

from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe
from drivers.serial_lines.loadstar_lines import Decoder as LoadstarDecoder
from drivers.serial_lines.loadstar_lines import Text, encode
from drivers.serial_lines.mantracourt_lines import Number, question
from drivers.serial_lines.mantracourt_lines import decode as mantracourt

SIGN = "1 or -1: -1 where forward thrust reads negative"


def _hear(_line: Line) -> Found | None:
    """A stream of numbers is taken for one of any instrument (recognising_streams)."""
    return None


def _loadstar(line: Line) -> Found | None:
    """An empty command would say `A`, and would carry out half a command of somebody else at another device."""
    model = _words(line, "MODEL")
    if "DI-" not in model:
        return None
    return Found(
        "loadstar",
        f"{model}, {_words(line, 'ID') or 'no ID told'}",
        "force",
        untold={"rate": "values/s: about 70 (DI-1000U), 500 (UHS), 575 or 1000 (UHS-1K)", "sign": SIGN},
        settings=(f"unit {_words(line, 'UNIT') or 'not told'}, capacity {_words(line, 'LC') or 'not told'}",),
        rate="sends nothing until it is asked",
    )


def _words(line: Line, command: str) -> str:
    came = line.ask(encode(command), lambda data: data.endswith(b"\n"))
    return next((each.words for each in LoadstarDecoder().feed(came) if isinstance(each, Text)), "")


def _mantracourt(line: Line) -> Found | None:
    for station in line.addresses:
        version, low, high = (_number(line, station, name) for name in ("VER", "SERL", "SERH"))
        if version is None or low is None or high is None:
            continue
        return Found(
            "mantracourt_dsc",
            f"Mantracourt DSC {version // 256}.{version % 256:02d}, serial number {high * 65536 + low}",
            "force",
            {"station": station},
            {"rate": "times/s that it is asked", "unit": "that SYS is calibrated in", "sign": SIGN},
            (f"RATE {_number(line, station, 'RATE')}",),
            "sends nothing until it is asked",
        )
    return None


def _number(line: Line, station: int, name: str) -> int | None:
    came = line.ask(question(station, name), lambda data: data.endswith(b"\r"), 0.2)
    answer = mantracourt(came.strip())
    return int(answer.value) if isinstance(answer, Number) else None


LOADSTAR = SerialProbe(
    rates=(Rate(9600), Rate(230400), Rate(115200)), asks="MODEL, ID, UNIT, LC", hear=_hear, ask=_loadstar, order=5
)
"""9600 8N1 of a DI-1000, 230400 of the fast models."""
MANTRACOURT = SerialProbe(
    rates=(Rate(115200), Rate(9600), Rate(19200), Rate(38400), Rate(57600)),
    asks="!001:VER?, SERL, SERH, RATE; only with --kind mantracourt_dsc",
    hear=_hear,
    ask=_mantracourt,
    order=40,
    named_only=True,
)
"""Its questions begin with the character of Roboteq's commands."""
