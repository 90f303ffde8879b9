"""The wake met at a sign change: T (1 - r e^(-t/tau)); t since the reversal, or since it turned the other way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.digits import percent
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.filters import since_opposite
from identification.run_history.history import TURNING


@dataclass(frozen=True, slots=True)
class ReversalLoss:
    """The wake met at a sign change: T (1 - r e^(-t/tau)); t since the reversal, or since it turned the other way."""

    id: ClassVar[str] = "reversal_loss"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "after a reversal the propeller works in its own wake"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_reversal", "time_since_step")
    traits: ClassVar[Traits] = Traits(
        moving=True,
        shown_over="time_since_reversal",
        shown_as="gain",
        revealed_by="the same step with and without a change of sign before it",
    )
    form: Literal["wake", "step"] = "wake"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("loss", "1", 0.0, 1.0, 0.0), Parameter("time_constant", "s", 0.1, 60.0))

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((0.1, tau) for tau in (0.3, 1.0, 3.0, 10.0))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        since_other, since_began, known = since_opposite(now.x, now.history.dt, TURNING * now.scale.driver)
        age = since_other if self.form == "wake" else since_began
        wake = np.where(known, np.exp(-np.maximum(age, 0.0) / theta[1]), 0.0)
        out: Floats = value * (1 - theta[0] * wake)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        turning = f"{TURNING * model.scale.driver:.6g}"
        what = "x last turned the other way" if self.form == "wake" else "x began to turn this way"
        since = "since_opposite" if self.form == "wake" else "since_turned"
        return (
            f"age = {since}(x, {turning})  # s since {what}, beyond {turning}; inf before a first reversal",
            f"F = F * (1 - {theta[0]:.6g} * exp(-age / {theta[1]:.6g}))",
        )

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Reversal loss: after a change of direction {percent(theta[0])} "
            f"% of the thrust is missing, for some {theta[1]:.2g} s."
        )


FORMS = (
    ReversalLoss("wake"),
    ReversalLoss("step"),
)
