"""A blade built for one direction: C- = ratio C+."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.digits import beside
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class Asymmetry:
    """A blade built for one direction: C- = ratio C+."""

    id: ClassVar[str] = "asymmetry"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "the two directions have different coefficients"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("direction",)
    traits: ClassVar[Traits] = Traits(even=True, revealed_by="the same levels of both signs, with rests between")
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("ratio", "1", 0.05, 20.0, 1.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.95,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = np.where(now.x < 0, theta[0] * value, value)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = where(x < 0, {theta[0]:.6g} * F, F)",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Asymmetry: in reverse the thruster gives {beside(theta[0], 1.0, 2)} "
            "of its forward thrust at the same voltage; use C+ and C-."
        )


FORMS = (Asymmetry(),)
