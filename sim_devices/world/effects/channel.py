"""A channel that lies: frozen, reversed, rescaled, unsigned, or gone (applied to each sample it gives)."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import nan
from typing import ClassVar

import numpy as np

from sim_devices.world.effects.stage import Floats, Stage, require_choice, require_positive
from sim_devices.world.history import History
from sim_devices.world.noise import CHANNELS
from sim_devices.world.state import State

KINDS = ("frozen", "reversed", "rescaled", "unsigned", "nan", "dropout")


@dataclass(slots=True)
class ChannelFault:
    """One channel, from `start` on for `duration` (0: for good).

    frozen: repeats its last good value. reversed: changes sign. rescaled: times `factor`. unsigned: loses its sign.
    nan: gives no number. dropout: gives no number for the last `factor` of every second (0..1).
    """

    stage: ClassVar[Stage] = "output"
    channel: str
    kind: str
    factor: float = 1.0
    start: float = 0.0
    """s of world time."""
    duration: float = 0.0
    """s."""
    last: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        require_choice("channel", self.channel, CHANNELS)
        require_choice("kind", self.kind, KINDS)
        if self.duration < 0:
            require_positive(duration=self.duration)

    def apply(self, value: float, s: State, _dt: float) -> float:
        if s.t < self.start or (self.duration and s.t >= self.start + self.duration):
            self.last = value
            return value
        return self._faulty(value, s.t)

    def over(self, value: Floats, h: History) -> Floats:
        """`h` is on the channel's own sample times."""
        late = h.t >= self.start + self.duration if self.duration else np.zeros(h.t.shape, dtype=bool)
        faulty = (h.t >= self.start) & ~late
        return np.where(faulty, self._all_faulty(value, h.t), value)

    def _all_faulty(self, value: Floats, t: Floats) -> Floats:
        match self.kind:
            case "frozen":
                before = np.flatnonzero(t < self.start)
                return np.full_like(value, value[before[-1]] if before.size else 0.0)
            case "reversed":
                return -value
            case "rescaled":
                return value * self.factor
            case "unsigned":
                return np.abs(value)
            case "dropout":
                return np.where(t % 1.0 >= 1.0 - self.factor, nan, value)
            case _:
                return np.full_like(value, nan)

    def _faulty(self, value: float, t: float) -> float:
        match self.kind:
            case "frozen":
                return self.last
            case "reversed":
                return -value
            case "rescaled":
                return value * self.factor
            case "unsigned":
                return abs(value)
            case "dropout":
                return nan if t % 1.0 >= 1.0 - self.factor else value
            case _:
                return nan
