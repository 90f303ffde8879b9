"""Quadratic drag that k2 |xi| xi leaves out: a hull that is blunter from one end than from the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext


@dataclass(frozen=True, slots=True)
class QuadraticDrag(Untouched):
    """k2 (1 + excess) while it moves backwards through the water, k2 while it moves ahead."""

    id: ClassVar[str] = "quadratic_drag"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "the quadratic drag ahead and astern differ"
    covariates: ClassVar[tuple[str, ...]] = ("speed",)
    form: str = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("astern_excess", "1", -0.9, 5.0, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((-0.2,), (0.2,), (1.0,))

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        return replace(body, astern=body.astern * (1 + theta[0]))

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        more = "more" if theta[0] > 0 else "less"
        back = {"heave": "upwards", "sway": "to port", "yaw": "to port"}.get(scale.axis, "astern")
        return f"Quadratic drag: {100 * abs(theta[0]):.3g} % {more} {back} than the other way."


FORMS = (QuadraticDrag(),)
