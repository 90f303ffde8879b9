"""The drive clips: V_eff = clip(V, -limit, limit); or gives less and less from an onset on, until a knee is passed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.soft_limit import knee, limited, mean_slope
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.history import History

LEAST_MOVE = 1e-6
"""Of the limit: what moves less within an interval stands still."""


@dataclass(frozen=True, slots=True)
class CommandSaturation:
    """The drive clips: V_eff = clip(V, -limit, limit); or gives less and less from an onset on, over a knee."""

    id: ClassVar[str] = "command_saturation"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the drive gives no more than a limit"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    traits: ClassVar[Traits] = Traits(
        limits="command",
        tick_by_tick=True,
        told_by=(("rotation_rate", "the measured rotation rate"),),
        revealed_by="current or rotation rate at the highest levels: they stop rising too",
    )
    form: Literal["hard", "knee"] = "hard"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        if self.form == "hard":
            return (Parameter("limit", scale.driver_unit, 0.2 * scale.driver, scale.driver, scale.driver),)
        return (
            Parameter("bend", f"1/{scale.driver_unit}", 0.0, 50.0 / scale.driver, 0.0),
            Parameter("onset", scale.driver_unit, 0.2 * scale.driver, 0.98 * scale.driver),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "hard":
            return tuple((share * scale.driver,) for share in (0.97, 0.92, 0.85, 0.75, 0.6))
        return tuple((0.5 / scale.driver, share * scale.driver) for share in (0.45, 0.6, 0.75, 0.88))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        size = np.abs(value)
        if self._start(theta) >= np.max(size):
            return value
        # a command that moves within an interval passes the limit in a part of it
        half = 0.5 * _moved(now.history, self._start(theta))
        if self.form == "knee":
            mean = limited(size, half, *theta)
        else:
            beyond = np.clip(size + half - theta[0], 0.0, 2 * half)
            mean = np.where(size - half >= theta[0], theta[0], size - beyond**2 / (4 * half))
        out: Floats = np.copysign(mean, value)
        return out

    def passed(self, history: History, theta: tuple[float, ...]) -> Floats:
        """(M,) share of what the command does within each interval, its ticks, that reaches the rotor."""
        size, moved = np.abs(history.driver), _moved(history, self._start(theta))
        if self.form == "knee":
            return mean_slope(size, 0.5 * moved, *theta)
        out: Floats = np.clip((theta[0] - size) / moved + 0.5, 0.0, 1.0)
        return out

    def _start(self, theta: tuple[float, ...]) -> float:
        """Where the drive begins to give less."""
        return theta[0] if self.form == "hard" else theta[1]

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V = model.symbol
        return (f"{V} = clip({V}, -{theta[0]:.6g}, {theta[0]:.6g})",) if self.form == "hard" else knee(V, *theta)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        unit = scale.driver_unit
        if self.form == "hard":
            most = f"no more than {theta[0]:.3g} {unit}"
            return f"Command saturation: the drive gives {most}; higher commands change nothing."
        full = np.array([scale.driver])
        least = float((full - limited(full, LEAST_MOVE * full, *theta))[0])
        return (
            f"Command saturation: from {theta[1]:.3g} {unit} on the drive gives less and less of what is asked, "
            f"{least:.2g} {unit} too little at {scale.driver:.3g} {unit}."
        )


def _moved(history: History, limit: float) -> Floats:
    """(M,) how far the command moves within each interval, by its variance there."""
    out: Floats = np.maximum(LEAST_MOVE * limit, np.sqrt(12 * np.abs(history.excess)))
    return out


FORMS = (CommandSaturation("hard"), CommandSaturation("knee"))
