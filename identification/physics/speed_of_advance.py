"""Tunnel flow through the disc: T - C_s |x| U (Fossen, bilinear thrust)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class SpeedOfAdvance:
    """Tunnel flow through the disc: T - C_s |x| U (Fossen, bilinear thrust)."""

    id: ClassVar[str] = "speed_of_advance"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "the flow through the disc takes thrust"
    needs: ClassVar[tuple[str, ...]] = ("flow_speed",)
    covariates: ClassVar[tuple[str, ...]] = ("flow_speed",)
    traits: ClassVar[Traits] = Traits(
        flow=True,
        shown_over="flow_speed",
        shown_as="gain",
        told_by=(("", "other flow speeds, recorded"),),
        revealed_by="flow with the propeller turning and at rest",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        u = max(scale.flow, 1e-6)
        return (
            Parameter(
                "coefficient",
                f"N/({scale.driver_unit} m/s)",
                0.0,
                3 * scale.thrust / scale.driver / u,
                0.0,
                told="loss per speed of the water",
            ),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.05 * scale.thrust / scale.driver / max(scale.flow, 1e-6),),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value - theta[0] * np.abs(now.x) * now.history.others["flow_speed"]
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = F - {theta[0]:.6g} * abs(x) * flow_speed",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Speed of advance: flow through the disc takes {theta[0]:.3g} N per {scale.driver_unit} and m/s."


FORMS = (SpeedOfAdvance(),)
