"""How long a hold lasts: a fixed time, or until it is steady."""

from __future__ import annotations

from dataclasses import dataclass

from rig.campaign.shapes import require, require_above_zero, require_not_negative


@dataclass(frozen=True, slots=True)
class FixedDwell:
    """Every hold lasts `duration` s; its first `settle` s are left out of the mean."""

    duration: float
    settle: float = 0.5

    def __post_init__(self) -> None:
        require_above_zero("dwell.duration", self.duration, "s")
        require_not_negative("dwell.settle", self.settle, "s")
        require(
            self.settle < self.duration,
            f"dwell.settle ({self.settle:g} s) must be shorter than dwell.duration ({self.duration:g} s)",
        )

    @property
    def bounds(self) -> tuple[float, float]:
        """Shortest and longest hold in s."""
        return self.duration, self.duration


@dataclass(frozen=True, slots=True)
class SteadyDwell:
    """A hold ends once standard error (N) and |drift| (N/s) are small: after `min` s, at `max` s at the latest."""

    min: float
    max: float
    max_std_error: float
    max_drift: float
    settle: float = 0.5

    def __post_init__(self) -> None:
        require_above_zero("dwell.min", self.min, "s")
        require_above_zero("dwell.max", self.max, "s")
        require_above_zero("dwell.max_std_error", self.max_std_error, "N")
        require_above_zero("dwell.max_drift", self.max_drift, "N/s")
        require_not_negative("dwell.settle", self.settle, "s")
        require(self.min <= self.max, f"dwell.min ({self.min:g} s) must not exceed dwell.max ({self.max:g} s)")
        require(
            self.settle < self.min, f"dwell.settle ({self.settle:g} s) must be shorter than dwell.min ({self.min:g} s)"
        )

    @property
    def bounds(self) -> tuple[float, float]:
        """Shortest and longest hold in s."""
        return self.min, self.max


Dwell = FixedDwell | SteadyDwell
