"""Cell or amplifier warms: + a (1 - e^(-t/tau)), or + rate t."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.equation import signed
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class ZeroDrift:
    """Cell or amplifier warms: + a (1 - e^(-t/tau)), or + rate t."""

    id: ClassVar[str] = "zero_drift"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the zero of the cell drifts"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        own_clock=True,
        one_shape=True,
        shown_over="time",
        revealed_by="rests again and again: a zero that moves shows there, a gain does not",
    )
    form: Literal["linear", "exponential"] = "linear"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = scale.thrust
        if self.form == "linear":
            return (Parameter("rate", "N/s", -most / scale.duration, most / scale.duration, 0.0),)
        return (
            Parameter("amplitude", "N", -most, most, 0.0),
            Parameter("time_constant", "s", 0.02 * scale.duration, 3 * scale.duration),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        if self.form == "linear":
            return ((0.01 * scale.thrust / scale.duration,),)
        return tuple((0.01 * scale.thrust, share * scale.duration) for share in (0.06, 0.2, 0.6))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        t = now.history.middle
        if self.form == "linear":
            return value + theta[0] * t
        out: Floats = value + theta[0] * (1 - np.exp(-t / theta[1]))
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        if self.form == "linear":
            return (f"F = F {signed(theta[0])} * t",)
        return (f"F = F {signed(theta[0])} * (1 - exp(-t / {theta[1]:.6g}))",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        if self.form == "linear":
            return f"Zero drift: the zero moves by {60 * theta[0]:.3g} N a minute, at rest too; tare more often."
        return (
            f"Zero drift: the zero moves by {theta[0]:.3g} N with a time constant "
            f"of {theta[1]:.3g} s, at rest too; let the amplifier warm up."
        )


FORMS = (
    ZeroDrift("linear"),
    ZeroDrift("exponential"),
)
