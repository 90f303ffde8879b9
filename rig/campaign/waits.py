"""Waits of a plan at 0 V: for the water to come to rest, and for a motor to cool down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rig.campaign.shapes import require, require_above_zero


@dataclass(frozen=True, slots=True)
class CoolDown:
    """`[plan.cool_down]`: before each tare but the last the run waits at 0 V until the motor is cool.

    Raises PlanError on impossible values.
    """

    channel: str
    """`<stream>.<channel>` in degC."""
    below: float
    """degC; the run goes on below it."""
    longest: float
    """s of one wait."""
    otherwise: Literal["end", "ask"] = "end"
    """What follows when it is not cool by then: the run ends, or it is paused for an operator to decide."""

    def __post_init__(self) -> None:
        require(-50.0 < self.below < 500.0, f"cool_down.below must be a temperature in degC, but is {self.below:g}")
        require_above_zero("cool_down.longest", self.longest, "s")


@dataclass(frozen=True, slots=True)
class Wait:
    """What one step waits for; both waits begin together."""

    water: float = 0.0
    """s that the water has to settle."""
    cool: CoolDown | None = None

    @property
    def bounds(self) -> tuple[float, float]:
        """Shortest and longest in s."""
        return self.water, max(self.water, self.cool.longest if self.cool else 0.0)

    def __str__(self) -> str:
        told = [f"{self.water:g} s for the water to settle"] if self.water else []
        if self.cool is not None:
            told.append(f"until {self.cool.channel} is below {self.cool.below:g} °C, at most {self.cool.longest:g} s")
        return "; ".join(told)


def wanted(water: float, cool: CoolDown | None) -> Wait | None:
    """None where there is nothing to wait for."""
    return Wait(water, cool) if water > 0.0 or cool is not None else None
