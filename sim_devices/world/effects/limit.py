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
    """clip(x, -limit, limit); form "soft": x / (1 + |x/limit|^KNEE)^(1/KNEE), which bends before it is flat.

    form "knee": the slope falls evenly from 1, `bend` per unit of x, and is 0 where the limit is reached.
    """

    stage: ClassVar[Stage]
    limit: float
    """In the unit of the stage."""
    form: str = "hard"
    bend: float = 0.0
    """One over the unit of the stage; only for "knee"."""

    def __post_init__(self) -> None:
        require_positive(limit=self.limit)
        require_choice("form", self.form, ("hard", "soft", "knee"))
        if self.form == "knee":
            require_positive(bend=self.bend)

    def apply(self, value: float, _s: State, _dt: float) -> float:
        if self.form == "hard":
            return min(max(value, -self.limit), self.limit)
        return float(self._bent(np.asarray(value)))

    def over(self, value: Floats, _h: History) -> Floats:
        return np.clip(value, -self.limit, self.limit) if self.form == "hard" else self._bent(value)

    def _bent(self, value: Floats) -> Floats:
        if self.form == "soft":
            return np.asarray(value / (1.0 + np.abs(value / self.limit) ** KNEE) ** (1.0 / KNEE))
        short = np.maximum(self.limit + 0.5 / self.bend - np.abs(value), 0.0)  # of where the slope is 0
        size = np.where(short < 1.0 / self.bend, self.limit - 0.5 * self.bend * short**2, np.abs(value))
        return np.asarray(np.copysign(size, value))


@dataclass(slots=True)
class CommandSaturation(Limit):
    """The drive gives no more than `limit` V."""

    stage: ClassVar[Stage] = "command"


@dataclass(slots=True)
class LoadCellSaturation(Limit):
    """Cell or amplifier clips at `limit` N, noise and all."""

    stage: ClassVar[Stage] = "output"
