"""Thrust + b V: laminar flow, or the slope of a servo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from identification.physics.equation import signed
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class LinearTerm:
    """Thrust + b V: laminar flow, or the slope of a servo."""

    id: ClassVar[str] = "linear_term"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "thrust has a part in proportion to the voltage"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    traits: ClassVar[Traits] = Traits(revealed_by="small and medium levels of both signs")
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (
            Parameter(
                "slope", f"N/{scale.driver_unit}", -scale.thrust / scale.driver, scale.thrust / scale.driver, 0.0
            ),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.02 * scale.thrust / scale.driver,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * now.x
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = F {signed(theta[0])} * x",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Linear term: thrust has a part of {theta[0]:.3g} N per {scale.driver_unit} beside the square."


FORMS = (LinearTerm(),)
