"""A value that cannot pass a limit: what a drive and a load cell's amplifier have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.history import History
from sim_devices.world.state import State

KNEE = 8.0
"""Of a limit that sets in softly: the larger, the sharper its bend."""


@dataclass(slots=True)
class Limit:
    """clip(x, -limit, limit); form "soft": x / (1 + |x/limit|^KNEE)^(1/KNEE), which bends before it is flat."""

    stage: ClassVar[Stage]
    limit: float
    """In the unit of the stage."""
    form: str = "hard"

    def __post_init__(self) -> None:
        require_positive(limit=self.limit)
        require_choice("form", self.form, ("hard", "soft"))

    def apply(self, value: float, _s: State, _dt: float) -> float:
        if self.form == "soft":
            return float(value / (1.0 + abs(value / self.limit) ** KNEE) ** (1.0 / KNEE))
        return min(max(value, -self.limit), self.limit)

    def over(self, value: Floats, _h: History) -> Floats:
        if self.form == "soft":
            return np.asarray(value / (1.0 + np.abs(value / self.limit) ** KNEE) ** (1.0 / KNEE))
        return np.clip(value, -self.limit, self.limit)


@dataclass(slots=True)
class CommandSaturation(Limit):
    """The drive gives no more than `limit` V."""

    stage: ClassVar[Stage] = "command"


@dataclass(slots=True)
class LoadCellSaturation(Limit):
    """Cell or amplifier clips at `limit` N, noise and all."""

    stage: ClassVar[Stage] = "output"
