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

    form "knee": from `onset` on the slope falls evenly, `bend` per unit of x, until nothing more is passed.
    """

    limit: float = 0.0
    """In the unit of the stage; of "hard" and "soft"."""
    form: str = "hard"
    onset: float = 0.0
    """In the unit of the stage; of "knee", as `bend`."""
    bend: float = 0.0
    """One over the unit of the stage."""

    def __post_init__(self) -> None:
        require_choice("form", self.form, ("hard", "soft", "knee"))
        if self.form == "knee":
            require_positive(onset=self.onset, bend=self.bend)
        else:
            require_positive(limit=self.limit)

    def apply(self, value: float, _s: State, _dt: float) -> float:
        if self.form == "hard":
            return min(max(value, -self.limit), self.limit)
        return float(self._bent(np.asarray(value)))

    def over(self, value: Floats, _h: History) -> Floats:
        return np.clip(value, -self.limit, self.limit) if self.form == "hard" else self._bent(value)

    def _bent(self, value: Floats) -> Floats:
        if self.form == "soft":
            return np.asarray(value / (1.0 + np.abs(value / self.limit) ** KNEE) ** (1.0 / KNEE))
        beyond = np.clip(np.abs(value) - self.onset, 0.0, 1.0 / self.bend)
        size = np.minimum(np.abs(value), self.onset) + beyond - 0.5 * self.bend * beyond**2
        return np.asarray(np.copysign(size, value))


@dataclass(slots=True)
class CommandSaturation(Limit):
    """The drive gives no more than `limit` V."""

    stage: ClassVar[Stage] = "command"


@dataclass(slots=True)
class LoadCellSaturation(Limit):
    """Cell or amplifier clips at `limit` N. place "output": the converter, noise and all, so that the reading stands.

    place "cell": the cell itself (an overload stop) and its zero, a load on it, with the force; noise is added after.
    """

    place: str = "output"
    middle: float = 0.0
    """N: of the two values at which readings end; not 0 where a zero is set behind what clips."""

    def __post_init__(self) -> None:
        Limit.__post_init__(self)
        require_choice("place", self.place, ("output", "cell"))

    def apply(self, value: float, s: State, dt: float) -> float:
        """What the zero adds later is left out of it."""
        zero = (s.zero if self.place == "cell" else 0.0) - self.middle
        return Limit.apply(self, value + zero, s, dt) - zero

    def over(self, value: Floats, h: History) -> Floats:
        zero = (h.zero if self.place == "cell" else 0.0) - self.middle
        return Limit.over(self, value + zero, h) - zero

    @property
    def stage(self) -> Stage:
        return "output" if self.place == "output" else "cell"
