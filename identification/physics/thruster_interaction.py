"""A neighbour runs: T (1 - e |T_j| / max |T_j|), the largest of the run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class ThrusterInteraction:
    """A neighbour runs: T (1 - e |T_j| / max |T_j|), the largest of the run."""

    id: ClassVar[str] = "thruster_interaction"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "a neighbouring thruster takes thrust when it runs"
    needs: ClassVar[tuple[str, ...]] = ("neighbour_thrust",)
    covariates: ClassVar[tuple[str, ...]] = ("neighbour_thrust",)
    traits: ClassVar[Traits] = Traits(
        neighbour=True,
        shown_over="neighbour_thrust",
        shown_as="gain",
        told_by=(("", "the neighbour switched on and off at one level"),),
        revealed_by="the neighbour switched on and off at one level",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("loss", "1", -0.5, 1.0, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.05,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        neighbour = np.abs(now.history.others["neighbour_thrust"])
        out: Floats = value * (1 - theta[0] * neighbour / max(float(np.max(neighbour)), 1e-12))
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Thruster interaction: with the neighbour at full thrust {100 * theta[0]:.3g} % of the thrust is lost."


FORMS = (ThrusterInteraction(),)
