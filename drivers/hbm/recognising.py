"""How AED electronics are recognised: `IDN?`. They are not told to stop a stream (`STP`): that is somebody else's."""

from __future__ import annotations

from drivers.hbm.frames import Answer, Decoder, encode
from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe


def _hear(_line: Line) -> Found | None:
    """Values in four bytes say of nobody whose they are."""
    return None


def _ask(line: Line) -> Found | None:
    identity = _answer(line, "IDN?")
    if not identity.startswith("HBM") and line.answers:  # questions to others may stand before it in the buffer
        identity = _answer(line, "IDN?")
    if not identity.startswith("HBM"):
        return None
    return Found(
        "hbm_aed",
        identity.replace('"', ""),
        "force",
        untold={
            "rate": "values/s: top_rate, its half, its quarter ...",
            "top_rate": "values/s at ICR0: 100 of an AD104, 600 of an AD101B, AD103C or FIT",
            "nominal_force": "N at nominal load of the characteristic that is in the electronics",
            "sign": "1 or -1: -1 where forward thrust reads negative",
        },
        settings=tuple(f"{name} {_answer(line, f'{name}?') or 'not told'}" for name in ("ICR", "NOV", "COF")),
        rate="sends nothing until it is asked",
    )


def _answer(line: Line, question: str) -> str:
    """Empty: none came."""
    came = line.ask(encode(question), lambda data: data.endswith(b"\r\n"))
    return next((each.text for each in Decoder().feed(came) if isinstance(each, Answer)), "")


PROBE = SerialProbe(
    rates=(Rate(9600, "8E1"), Rate(9600), Rate(38400, "8E1"), Rate(19200, "8E1"), Rate(115200, "8E1")),
    asks="IDN?, ICR?, NOV?, COF?",
    hear=_hear,
    ask=_ask,
    order=15,
)
"""9600 8E1 is the factory's."""
