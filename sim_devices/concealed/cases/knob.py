"""An effect with one knob: how much of the effect there is, everything else of it given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

LEAST = 0.002
"""Of the highest amount: below it nobody would speak of the effect."""


@dataclass(frozen=True, slots=True)
class Scale:
    """What is large for the thruster and the run under test."""

    voltage: float
    """V, largest command."""
    thrust: float
    """N, at that command."""
    rate: float
    """rev/s, at that command."""
    duration: float
    """s."""
    current: float
    """A, at that command."""
    rise: float
    """K of the winding after long at that command."""
    bus: float
    """V, nominal."""
    flow: float
    """m/s, fastest of the run."""
    sampling: float
    """1/s, of the thrust."""
    grid: float
    """s, of the world: nothing shorter happens in it."""


@dataclass(frozen=True, slots=True)
class Shape:
    """One effect: `knob` = base + gain * amount (1 / (gain * amount) when inverse); amount 0 is no effect."""

    effect: str
    knob: str
    highest: float
    """Largest amount that is still physical."""
    gain: float = 1.0
    base: float = 0.0
    inverse: bool = False
    fixed: Mapping[str, Any] = field(default_factory=dict)
    with_knob: Mapping[str, float] = field(default_factory=dict)
    """Further parameters in proportion to gain * amount."""
    lowest: float = 0.0
    """Least amount worth the name; 0: LEAST of the highest."""
    start: float = 0.0
    """Amount that a search begins with; 0: a twentieth of the highest."""
    quantum: float = 0.0
    """gain * amount comes in whole multiples of it, one at least; 0: it is continuous."""

    @property
    def first(self) -> float:
        """Amount that a search begins with."""
        return max(self.start or 0.05 * self.highest, self.lowest or LEAST * self.highest)

    def parameters(self, amount: float) -> dict[str, Any]:
        """Of the world's effect."""
        moved = self.gain * amount
        if self.quantum:
            moved = max(round(moved / self.quantum), 1) * self.quantum
        turned = {name: ratio * moved for name, ratio in self.with_knob.items()}
        return {**self.fixed, **turned, self.knob: 1.0 / moved if self.inverse else self.base + moved}
