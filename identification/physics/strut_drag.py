"""Flow on the mounting: + s U|U|."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.equation import signed
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class StrutDrag:
    """Flow on the mounting: + s U|U|."""

    id: ClassVar[str] = "strut_drag"
    stage: ClassVar[Stage] = "stand"
    physics: ClassVar[str] = "the flow pushes on the mounting"
    needs: ClassVar[tuple[str, ...]] = ("flow_speed",)
    covariates: ClassVar[tuple[str, ...]] = ("flow_speed",)
    traits: ClassVar[Traits] = Traits(
        shown_over="flow_speed",
        told_by=(("", "other flow speeds, recorded"),),
        revealed_by="flow with the propeller at rest",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        u = max(scale.flow, 1e-6)
        return (
            Parameter(
                "coefficient", "N/(m/s)^2", -scale.thrust / u**2, scale.thrust / u**2, 0.0, told="drag of the strut"
            ),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((-0.02 * scale.thrust / max(scale.flow, 1e-6) ** 2,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        flow = now.history.others["flow_speed"]
        out: Floats = value + theta[0] * flow * np.abs(flow)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = F {signed(theta[0])} * flow_speed * abs(flow_speed)",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Strut drag: the flow pushes on the mounting with {theta[0]:.3g} N/(m/s)^2, also at rest of the propeller."
        )


FORMS = (StrutDrag(),)
