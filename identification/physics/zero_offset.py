"""The zero jumps (a knock, a cable that pulls): + b from a time on. A constant offset of a run is its tare."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class ZeroOffset:
    """The zero jumps (a knock, a cable that pulls): + b from a time on. A constant offset of a run is its tare."""

    id: ClassVar[str] = "zero_offset"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the zero of the cell jumped between two tares"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time",)
    traits: ClassVar[Traits] = Traits(moving=True, own_clock=True, instant="at", revealed_by="rests before and after")
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = 2 * scale.reading
        return (
            Parameter("offset", "N", -most, most, 0.0),
            Parameter("at", "s", 0.0, scale.duration, jumps=True, told="instant"),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((0.01 * scale.thrust, share * scale.duration) for share in np.linspace(0.02, 0.98, 80))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        step = 0.96 * scale.duration / 79
        return tuple((values[0], values[1] + share * step) for share in np.linspace(-1.0, 1.0, 25))

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        ramp = 2e-3 * now.scale.duration
        edges = (now.history.edges - theta[1]) / ramp
        area = np.where(np.abs(edges) < 0.5, 0.5 * (edges + 0.5) ** 2, np.maximum(edges, 0.0))
        out: Floats = value + theta[0] * np.diff(area) * ramp / now.history.dt
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = F + where(t < {theta[1]:.6g}, 0, {theta[0]:.6g})",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Zero offset: the zero of the cell jumped by {theta[0]:.3g} "
            f"N at {theta[1]:.4g} s; tare again, and look for what pulled."
        )


FORMS = (ZeroOffset(),)
