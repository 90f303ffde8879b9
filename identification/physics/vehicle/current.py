"""A uniform current: drag follows the velocity through the water, the recording has that over ground."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, degrees, hypot, isfinite
from typing import ClassVar, Literal

import numpy as np

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext

ONE_HEADING = 0.02
"""Spread of the heading below which only the current along it is seen."""


@dataclass(frozen=True, slots=True)
class Current(Untouched):
    """`uniform`: north and east, turned by the recorded heading. `along`: along the axis, of runs at one heading."""

    id: ClassVar[str] = "current"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "the water moves"
    covariates: ClassVar[tuple[str, ...]] = ("heading", "speed")
    form: Literal["uniform", "along"] = "uniform"

    def needs(self, scale: Scale) -> str:
        if scale.axis not in ("surge", "sway"):
            return f"a current is not felt in {scale.axis}"
        turning = isfinite(scale.heading_spread) and scale.heading_spread > ONE_HEADING
        if self.form == "uniform":
            return "" if turning else "one heading shows the current along it only"
        return "the heading turns: north and east are seen" if turning else ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = 1.5 * scale.speed
        names = ("north", "east") if self.form == "uniform" else ("along",)
        return tuple(Parameter(name, "m/s", -most, most, 0.0) for name in names)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        size = 0.05 * scale.speed
        if self.form == "along":
            return ((size,), (-size,), (8 * size,), (-8 * size,))
        return tuple((size * f * a, size * f * b) for f in (1, 6) for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)))

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        if self.form == "along":
            return replace(body, water=body.water + theta[0])
        psi = np.where(np.isfinite(now.heading), now.heading, 0.0)
        if now.scale.axis == "sway":
            return replace(body, water=body.water + theta[1] * np.cos(psi) - theta[0] * np.sin(psi))
        return replace(body, water=body.water + theta[0] * np.cos(psi) + theta[1] * np.sin(psi))

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        if self.form == "along":
            return f"Current: the water moves at {theta[0]:+.3g} m/s along the {scale.axis} axis of these runs."
        towards = degrees(atan2(theta[1], theta[0])) % 360
        return f"Current: the water moves at {hypot(*theta):.3g} m/s towards {towards:.0f} degrees."


FORMS = (Current("uniform"), Current("along"))
