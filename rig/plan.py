"""Plans: frozen data whose iteration yields the steps of a run. Refused or timed before a motor turns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Phase = Literal["tare", "ramp", "hold", "rest", "sine", "free"]


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a plan.

    The command goes from the previous step's end value to `voltage` with the slew limit inside a `ramp` step of its own;
    `hold`, `rest` and `tare` keep it. A `sine` step commands `voltage + amplitude * sin(2 pi frequency t)`, t from its start.
    """

    index: int
    phase: Phase
    voltage: float
    """V, constant part of the command at the end of the step."""
    min_duration: float
    """s. For a fixed dwell min_duration == max_duration."""
    max_duration: float
    """s. A hold until steady ends at the latest here, with verdict `not steady`."""
    from_voltage: float = 0.0
    """V at the start; differs from `voltage` in a ramp only."""
    amplitude: float = 0.0
    frequency: float = 0.0
    settle: float = 0.0
    """s after the start of a hold that is left out of its mean (at least; identification finds its own)."""
