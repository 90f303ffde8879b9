"""Buoyancy: weight and displacement do not balance, a steady force in heave."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext


@dataclass(frozen=True, slots=True)
class BuoyancyOffset(Untouched):
    """`shared`: one force in all runs. `by_ballast`: one for each ballast (section 4.2.4). Positive: it sinks."""

    id: ClassVar[str] = "buoyancy_offset"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "weight and buoyancy do not balance"
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    form: Literal["shared", "by_ballast"] = "shared"

    def needs(self, scale: Scale) -> str:
        if scale.axis != "heave":
            return f"buoyancy does not act in {scale.axis}"
        return "" if self.form == "shared" or len(scale.ballasts) > 1 else "all runs have one ballast"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        names = ("force",) if self.form == "shared" else tuple(f"force[{one}]" for one in scale.ballasts)
        return tuple(Parameter(name, scale.force_unit, -2 * scale.force, 2 * scale.force, 0.0) for name in names)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        count = len(self.parameters(scale))
        return ((0.02 * scale.force,) * count, (-0.02 * scale.force,) * count)

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        force = theta[0] if self.form == "shared" else theta[now.scale.ballasts.index(now.ballast)]
        return replace(body, steady=body.steady + force)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        if self.form == "shared":
            way = "sinks" if theta[0] > 0 else "floats"
            return f"Buoyancy offset: left to itself the vehicle {way}, with {abs(theta[0]):.3g} {scale.force_unit}."
        told = ", ".join(f"{one} {force:+.3g}" for one, force in zip(scale.ballasts, theta, strict=True))
        return f"Buoyancy offset: a steady force in each ballast, {scale.force_unit} downwards: {told}."


FORMS = (BuoyancyOffset("shared"), BuoyancyOffset("by_ballast"))
