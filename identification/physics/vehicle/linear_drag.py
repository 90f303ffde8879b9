"""Linear drag: skin friction of slow flow, and what a quadratic law lacks at low speed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext


@dataclass(frozen=True, slots=True)
class LinearDrag(Untouched):
    """- k xi beside - k2 |xi| xi (eq. 4.13)."""

    id: ClassVar[str] = "linear_drag"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "drag has a part in proportion to the speed"
    covariates: ClassVar[tuple[str, ...]] = ("speed",)
    form: str = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("k", scale.over(f"({scale.speed_unit})"), 0.0, 10 * scale.force / scale.speed, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.force / scale.speed,) for share in (0.03, 0.2, 0.7))

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        return replace(body, linear=body.linear + theta[0])

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        unit = self.parameters(scale)[0].unit
        return f"Linear drag: {theta[0]:.3g} {unit} in proportion to the speed, beside the quadratic drag."


FORMS = (LinearDrag(),)
