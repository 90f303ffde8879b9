"""Added mass: water that a body must accelerate with itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext

MOST: Mapping[str, float] = {"surge": 1.0, "sway": 3.0, "heave": 3.0, "yaw": 3.0}
"""Of the stated inertia. A sphere has 0.5 of what it displaces, slender bodies less lengthwise and 1 across (Newman,
table 4.3); open frames that carry plates and foam reach 1 ahead and 2 to 3 across."""


@dataclass(frozen=True, slots=True)
class AddedMass(Untouched):
    """(m + m_a) xi' for a stated m."""

    id: ClassVar[str] = "added_mass"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "water is accelerated with the vehicle"
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    form: str = ""

    def needs(self, scale: Scale) -> str:
        return "" if scale.mass is not None else "without a stated mass the inertia is fitted, added mass included"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = MOST[scale.axis] * (scale.mass or 1.0)
        return (Parameter("mass", scale.mass_unit, 0.0, most, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        most = self.parameters(scale)[0].high
        return tuple((share * most,) for share in (0.05, 0.3, 0.8))

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        return replace(body, mass=body.mass + theta[0])

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        share = f" ({100 * theta[0] / scale.mass:.3g} % of the stated mass)" if scale.mass else ""
        return f"Added mass: {theta[0]:.3g} {scale.mass_unit} of water move with the vehicle{share}."


FORMS = (AddedMass(),)
