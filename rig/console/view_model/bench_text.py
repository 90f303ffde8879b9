"""The devices of the bench in words: identity, port, health, rates, ages, calibration, watchdog, limits. Pure."""

from __future__ import annotations

from typing import Final

from rich.text import Text

from rig.console.view_model import wording
from rig.console.view_model.view import View
from rig.link.front_end_messages import Device, Reading, Snapshot, StreamHealth

OLD: Final = 1.0
OLD_PERIODS: Final = 5
"""s and sample periods, whichever is longer, without a row: as the preflight judges it."""
RATE_TOLERANCE: Final = 0.25
"""Of the stated rate: as the preflight judges it."""
SOON: Final = 30
"""Days before the end of a calibration from which that is told in yellow."""
DEVICE_STYLES: Final = {
    "ok": "#7fd88f",
    "RATE": "bold #1b1b1b on #f0c040",
    "SILENT": "bold #1b1b1b on #f0c040",
    "LOST": "bold #ffffff on #c02030",
    "NOT OPEN": "#f0c040",
    "OLD": "#9a9a9a",
}
NAME: Final = 20
"""Cells for the name of a device or stream."""
QUIET, TROUBLE = "#9a9a9a", "bold #f0c040"


def bench_text(view: View) -> Text:
    """A paragraph per device, then the limits."""
    snapshot, text = view.snapshot, Text()
    if snapshot is None or not snapshot.devices:
        return text.append("No device is known yet: the controller has not told of them.")
    for device in snapshot.devices:
        _device(text, device, view, snapshot)
        text.append("\n")
    _limits(text, snapshot)
    text.right_crop(1)
    return text


def device_state(device: Device, silence: float, *, live: bool) -> str:
    """In a word; `silence` s since the newest snapshot. What is not live is OLD, whatever it was then."""
    if not live:
        return "OLD"
    if not device.identity:
        return "NOT OPEN"
    if device.fault:
        return "LOST"
    if any(_silent(stream, silence) for stream in device.streams):
        return "SILENT"
    return "RATE" if any(_off_rate(stream) for stream in device.streams) else "ok"


def _silent(stream: StreamHealth, silence: float) -> bool:
    return stream.age is None or stream.age + silence > max(OLD, OLD_PERIODS / stream.nominal)


def _off_rate(stream: StreamHealth) -> bool:
    return stream.rate is not None and abs(stream.rate / stream.nominal - 1.0) > RATE_TOLERANCE


def _device(text: Text, device: Device, view: View, snapshot: Snapshot) -> None:
    word = device_state(device, view.silence, live=view.condition == "live")
    text.append(f"{device.name:<{NAME}} ", "bold").append(word, DEVICE_STYLES[word])
    text.append(f"  {device.kind}{f' on {device.port}' if device.port else ''}\n", QUIET)
    said = next((check.text for check in snapshot.checks if check.name == device.name), "not opened yet")
    _line(text, device.fault or device.identity or said, TROUBLE if word in ("LOST", "NOT OPEN") else "")
    for stream in device.streams if device.identity else ():
        _line(text, _rate(stream, view.silence), TROUBLE if _off_rate(stream) or _silent(stream, view.silence) else "")
    if device.received:
        _line(text, _frames(device), TROUBLE if device.bad or device.dropped else QUIET)
    _line(text, *_calibration(device))
    if device.watchdog:
        _line(text, f"watchdog: {device.watchdog}", "")
        _line(text, _measured(device), "" if device.watchdog_measured is not None else QUIET)


def _line(text: Text, said: str, style: str) -> None:
    text.append(f"  {said}\n", style)


def _rate(stream: StreamHealth, silence: float) -> str:
    rate = "no rate yet" if stream.rate is None else f"{stream.rate:.3g}/s"
    age = "none came" if stream.age is None else f"newest {wording.age(stream.age + silence)} old"
    return f"{stream.name:<{NAME - 2}} {rate:>11} of {f'{stream.nominal:.3g}/s,':<8} {age}"


def _frames(device: Device) -> str:
    first = f", first: {device.first_bad}" if device.first_bad else ""
    lost = f"; {device.dropped} lost: the loop did not take them in time" if device.dropped else ""
    return f"{device.bad} of {device.received} frames not understood{first}{lost}"


def _calibration(device: Device) -> tuple[str, str]:
    if not device.calibrated:
        return "calibration: the bench file has no date of one", QUIET
    said = f"calibrated {device.calibrated}{f' ({device.certificate})' if device.certificate else ''}"
    left = device.days_left
    if left is None:
        return said, ""
    rest = f"OVER for {-left} days" if left < 0 else f"{left} days left"
    return f"{said}, valid until {device.valid_until}: {rest}", TROUBLE if left <= SOON else ""


def _measured(device: Device) -> str:
    if device.watchdog_measured is None:
        return "watchdog: not measured yet in this campaign"
    return f"watchdog measured: at rest {device.watchdog_measured:.2f} s after the last command"


def _limits(text: Text, snapshot: Snapshot) -> None:
    text.append("limits\n", "bold")
    limited = [reading for reading in snapshot.readings if wording.limits(reading) or reading.max_age is not None]
    for reading in limited:
        _line(text, _limit(reading), "")
    if not limited:
        _line(text, "none", QUIET)


def _limit(reading: Reading) -> str:
    band = wording.limits(reading)
    value = f"{band} {wording.unit(reading.unit)}" if band else ""
    age = f"at most {reading.max_age:g} s old" if reading.max_age is not None else ""
    return f"{reading.channel:<32} {value:<16} {age}".rstrip()
