"""Lines of text on a serial port: cutting bytes into lines, and how many lines a port can carry."""

from __future__ import annotations

import re

MAX_LINE = 1024
"""Bytes; no instrument here sends lines nearly as long, so a longer one is noise and is cut."""

_FRAMING = re.compile(r"([78])([NEO])([12])")


class LineCutter:
    """Bytes in any portions -> complete lines without their CR and LF. Empty lines are left out."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        *lines, rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(rest) > MAX_LINE:
            lines.append(rest[:MAX_LINE])
            rest = b""
        self._rest = rest
        return [line for line in lines if line]


def bits_per_character(framing: str) -> int:
    """Bits on the wire per byte: start, data, parity, stop. `8N1` is 10, `8E1` is 11."""
    parts = _FRAMING.fullmatch(framing)
    if parts is None:
        raise ValueError(f"framing must look like 8N1 or 7E1, not {framing!r}")
    data, parity, stop = parts.groups()
    return 1 + int(data) + (parity != "N") + int(stop)


HOST_DELAY_STD = 0.0005
"""s, 1 sigma: what the least delay of a serial adapter and the computer is not known by (its timer set to 1 ms)."""


def line_time(baud: int, framing: str, characters: int) -> float:
    """S that a message of `characters` bytes is on the wire."""
    return bits_per_character(framing) * characters / baud


def check_line_rate(who: str, rate: float, baud: int, framing: str, characters: int) -> None:
    """Raise ValueError when `rate` messages/s of `characters` bytes each do not fit through `baud` bit/s."""
    if not 0.0 < rate < float("inf"):
        raise ValueError(f"{who} rate must be a positive number of samples/s, not {rate}")
    if baud <= 0:
        raise ValueError(f"{who} baud must be positive, not {baud}")
    limit = 1.0 / line_time(baud, framing, characters)
    if rate > limit:
        raise ValueError(
            f"{who} asks {rate:g} samples/s but {baud} baud carries at most {limit:.0f}/s"
            f" ({characters} characters a sample): lower rate or raise baud"
        )


def check_acquisition(who: str, **seconds: float | None) -> None:
    """Raise ValueError for a delay, its error or a window that is negative, not finite or longer than a minute."""
    for name, value in seconds.items():
        if value is not None and not 0.0 <= value <= 60.0:
            raise ValueError(f"{who} {name} must be between 0 and 60 s, not {value}")


def check_gain_std(who: str, gain_std: float | None) -> None:
    """Raise ValueError for what is no relative error of a calibration: 0.5 is 50 %, and was one in per cent."""
    if gain_std is not None and not 0.0 <= gain_std < 0.1:
        raise ValueError(
            f"{who} gain_std is relative (0.0005 = 0.05 %) and below 0.1, but is {gain_std:g}: is it one in per cent?"
        )


def check_low_pass(who: str, time_constant: float | None, delay: float) -> None:
    """Raise ValueError for a low pass whose group delay, which is its time constant, is not in `delay` (s)."""
    if time_constant is not None and not 0.0 <= time_constant <= delay:
        raise ValueError(
            f"{who} low_pass must be between 0 and its delay ({delay} s), in which its group delay is, "
            f"not {time_constant}: add it to delay"
        )


def printable(line: bytes) -> str:
    """A line as it can be shown to a person, shortened to 80 characters."""
    return line[:80].decode("ascii", errors="backslashreplace")
