"""What an effect is to the world."""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from sim_devices.world.history import History
from sim_devices.world.state import State

Stage = Literal["command", "motor", "rotor", "hydro", "stand", "cell", "output"]
Floats = NDArray[np.float64]


class Effect(Protocol):
    """Changes one number of the world at its stage."""

    @property
    def stage(self) -> Stage:
        """Where it acts: of most effects a constant of the class."""
        ...

    def apply(self, value: float, s: State, dt: float, /) -> float:
        """The number with this effect in it. `dt` in s; called once per world step (stage `output`: per sample)."""

    def over(self, value: Floats, h: History, /) -> Floats:
        """The same over a whole run at once, from rest; an effect is asked either way, never both."""


def require_positive(**values: float) -> None:
    """Raise ValueError naming the first parameter that is not above zero."""
    for name, value in values.items():
        if not value > 0:
            raise ValueError(f"{name} must be above zero, got {value!r}")


def require_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    """Raise ValueError unless `value` is one of `choices`."""
    if value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(choices)}, got {value!r}")
