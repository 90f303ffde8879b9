"""What a simulated weigh module is set to, and how it writes a weight (format: see mt_sics.py)."""

from __future__ import annotations

from dataclasses import dataclass

STANDARD_GRAVITY = 9.80665
"""m/s^2, exact (CGPM 1901): what balances that show mass are adjusted with."""
UNITS = {"N": 1.0, "g": STANDARD_GRAVITY / 1000.0, "kg": STANDARD_GRAVITY}
"""unit -> N."""


@dataclass(frozen=True, slots=True)
class MtSicsOptions:
    """`[devices.<name>]` of kind mt_sics."""

    kind: str
    port: str
    baud: int = 9600
    model: str = "WXS-SIM"
    serial: str = "B021002593"
    unit: str = "N"
    digit: float = 0.001
    """Smallest step shown, in `unit`."""
    capacity: float = 500.0
    """N: beyond it the reply is `+` or `-`."""
    rate: float = 92.0
    """readings/s at power-up; UPD changes it."""
    max_rate: float = 92.0
    """readings/s, the most UPD accepts."""
    stable_band: float = 0.3
    """N."""
    average: int = 1
    """Conversions, evenly spread over the time between two readings, of which a reading is the mean."""
    clock_error: float = 0.0
    """relative: its clock runs faster by so much, and its readings come as much more often."""

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise ValueError(f"unit must be one of {', '.join(UNITS)}, got {self.unit!r}")
        if self.average < 1:
            raise ValueError(f"average must be at least 1, got {self.average}")
        if not 0 < self.rate <= self.max_rate or self.digit <= 0:
            raise ValueError("0 < rate <= max_rate and digit > 0 are needed")


def shown(newtons: float, unit: str, digit: float) -> str:
    """Ten characters, right aligned, rounded to `digit`, and the unit."""
    decimals = len(f"{digit:.9f}".rstrip("0").partition(".")[2])
    value = round(newtons / UNITS[unit] / digit) * digit + 0.0
    return f"{value:10.{decimals}f} {unit}"


def line(text: str) -> bytes:
    """A reply as it goes on the wire."""
    return text.encode("ascii") + b"\r\n"
