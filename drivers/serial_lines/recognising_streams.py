"""How instruments that send by themselves are recognised: Nortek's sentences, and lines with one number each."""

from __future__ import annotations

import re
from collections import Counter

from drivers.ports.lines import LineCutter
from drivers.recognition.found import Found
from drivers.recognition.serial_line import Line, Rate, SerialProbe
from drivers.serial_lines.nortek_nmea import OtherSentence, Velocity
from drivers.serial_lines.nortek_nmea import decode as nortek

LEAST_LINES = 4
"""Whole lines that a stream is judged by."""
MOST_ODD = 0.1
"""Share of the lines that may be otherwise: the first is half a one, a header comes after a restart."""
NUMBER = re.compile(rb"\s*(?P<value>[-+]?\s*\d+(?:\.\d+)?)(?P<between>\s*)(?P<unit>[A-Za-z]{0,6})\s*")


def _whole_lines(heard: bytes) -> list[bytes]:
    """The first may have been under way when the port was opened."""
    return LineCutter().feed(heard)[1:]


def _hear_nortek(line: Line) -> Found | None:
    records = [nortek(each) for each in LineCutter().feed(line.heard)]
    velocities = [record for record in records if isinstance(record, Velocity)]
    if not velocities:
        others = {record.identifier for record in records if isinstance(record, OtherSentence)}
        if not any(each.startswith("PNOR") for each in others):
            return None
        settings: tuple[str, ...] = (f"sends {', '.join(sorted(others))}: set data format 101 ($PNORC1) in it",)
    else:
        settings = ("sends $PNORC1 with a good checksum",)
    cells = max((record.cell for record in velocities), default=1)
    rate = len(velocities) / cells / line.heard_for if line.heard_for else 0.0
    return Found(
        "nortek_nmea",
        "Nortek velocimeter (it does not send its serial number)",
        keys={"rate": max(1.0, round(rate)), "cells": cells},
        untold={
            "component": "1, 2 or 3: which velocity lies along the thruster's axis",
            "sign": "1 or -1: positive when the water comes at the thruster from ahead",
        },
        settings=settings,
        rate=f"sends about {rate:.2g} measurements/s of {cells} cell(s) by itself",
    )


def _hear_numbers(line: Line) -> Found | None:
    lines = _whole_lines(line.heard)
    fitting = [found for each in lines if (found := NUMBER.fullmatch(each)) is not None]
    if len(lines) < LEAST_LINES or len(fitting) < (1 - MOST_ODD) * len(lines):
        return None
    unit = Counter(found["unit"] for found in fitting).most_common(1)[0][0].decode()
    counts = not unit and all(found["value"].strip(b"+- ").isdigit() for found in fitting)
    pattern = r"(?P<raw>[-+]?\d+)" if counts else r"(?P<value>[-+]?\d+(?:\.\d+)?)"
    pattern += rf"\s*(?P<unit>{unit})" if unit else ""
    rate = len(lines) / line.heard_for
    shown = fitting[-1][0].decode()
    return Found(
        "line_stream",
        "lines with one number each, from a device that says no name",
        "force",
        {"pattern": pattern, "rate": float(f"{rate:.2g}"), "line_characters": max(map(len, lines)) + 2},
        {
            "quantity": "thrust, or whatever the number is",
            "unit": "SI unit of scale x number + offset",
            "scale": "unit per " + (f"{unit}" if unit else "count or digit of the line"),
        },
        (f"such as {shown.strip()!r}",),
        f"sends about {rate:.2g} lines/s by itself",
    )


STREAM_RATES = (Rate(9600), Rate(115200), Rate(57600), Rate(38400), Rate(19200), Rate(230400))

NORTEK = SerialProbe(rates=STREAM_RATES[:5], asks="nothing", hear=_hear_nortek)
NUMBERS = SerialProbe(rates=STREAM_RATES, asks="nothing", hear=_hear_numbers, order=90)
"""Last: numbers are in the lines of others too."""
