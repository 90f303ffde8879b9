"""The drive clips: V_eff = clip(V, -limit, limit)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.history import History
from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats

LEAST_MOVE = 1e-6
"""Of the limit: what moves less within an interval stands still."""


def passed(history: History, limit: float) -> Floats:
    """(M,) share of each interval in which the command is below the limit, and its ticks reach the rotor."""
    out: Floats = np.clip((limit - np.abs(history.driver)) / _moved(history, limit) + 0.5, 0.0, 1.0)
    return out


def _moved(history: History, limit: float) -> Floats:
    """(M,) how far the command moves within each interval, by its variance there."""
    out: Floats = np.maximum(LEAST_MOVE * limit, np.sqrt(12 * np.abs(history.excess)))
    return out


@dataclass(frozen=True, slots=True)
class CommandSaturation:
    """The drive clips: V_eff = clip(V, -limit, limit)."""

    id: ClassVar[str] = "command_saturation"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the drive gives no more than a limit"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("limit", scale.driver_unit, 0.2 * scale.driver, scale.driver, scale.driver),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.driver,) for share in (0.97, 0.92, 0.85, 0.75, 0.6))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        if theta[0] >= np.max(np.abs(value)):
            return value
        # a command that moves within an interval passes the limit in a part of it
        half = 0.5 * _moved(now.history, theta[0])
        size = np.abs(value)
        beyond = np.clip(size + half - theta[0], 0.0, 2 * half)
        mean = np.where(size - half >= theta[0], theta[0], size - beyond**2 / (4 * half))
        out: Floats = np.copysign(mean, value)
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Command saturation: the drive gives no more than {theta[0]:.3g} "
            f"{scale.driver_unit}; higher commands change nothing."
        )


FORMS = (CommandSaturation(),)
