"""A tether: the farther the vehicle has gone, the more line it drags, or the harder the line pulls back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext


@dataclass(frozen=True, slots=True)
class TetherDrag(Untouched):
    """`drag`: - c L |xi| xi with L paid out. `pull`: - s x, weight or tension of the line.

    L and x count from the start of the run; in heave, from the surface where the depth was recorded.
    """

    id: ClassVar[str] = "tether_drag"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "a tether drags or pulls, the more the farther out"
    covariates: ClassVar[tuple[str, ...]] = ("position",)
    form: Literal["drag", "pull"] = "drag"

    def needs(self, scale: Scale) -> str:
        return "a tether is not pulled in yaw" if scale.axis == "yaw" else ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        if self.form == "drag":
            most = 10 * scale.force / scale.speed**2 / scale.length
            return (Parameter("drag_per_length", scale.over("(m/s)^2", "m"), 0.0, most, 0.0),)
        return (Parameter("stiffness", scale.over("m"), 0.0, 5 * scale.force / scale.length, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        most = self.parameters(scale)[0].high
        return tuple((share * most,) for share in (0.002, 0.02, 0.1))

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        if self.form == "drag":
            return replace(body, line_drag=body.line_drag + theta[0])
        return replace(body, line_pull=body.line_pull + theta[0])

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        unit = self.parameters(scale)[0].unit
        if self.form == "drag":
            return f"Tether drag: each metre of line paid out adds {theta[0]:.3g} {unit} of quadratic drag."
        return f"Tether drag: the line pulls back with {theta[0]:.3g} {unit} of way."


FORMS = (TetherDrag("drag"), TetherDrag("pull"))
