"""A number with its uncertainty, and a stretch of what was recorded: what all rooms state results in."""

from __future__ import annotations

from dataclasses import dataclass

QUANTILE = 1.959964
"""Standard errors to the end of a 95 % interval."""


@dataclass(frozen=True, slots=True)
class Value:
    value: float
    std: float
    """Such that value +- 1.96 std holds the whole 95 % interval."""
    unit: str
    ends: tuple[float, float] | None = None
    """Of the 95 % interval, where it is not value +- 1.96 std."""

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval; NaN where the data do not determine the value."""
        half = QUANTILE * self.std
        return self.ends or (self.value - half, self.value + half)


@dataclass(frozen=True, slots=True)
class Where:
    """A stretch of a quantity of recording-format.md, or of time, time_since_step, previous_voltage, direction ..."""

    quantity: str
    low: float
    high: float
    unit: str
