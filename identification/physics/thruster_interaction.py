"""A neighbour's jet flows through the disc: T - C_s |n| U_j, U_j = sqrt(2 |T_j| / (rho A)) at the neighbour's disc."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats

STANDS_IN = "neighbour_thrust: V|V| of its command where no thrust of it was recorded"


@dataclass(frozen=True, slots=True)
class ThrusterInteraction:
    """T - loss C |x| V_max sqrt(|T_j| / max |T_j|): a jet is as fast as the root of the thrust that makes it.

    Nienhuis (1992), *Analysis of thruster effectivity for dynamic positioning and low speed manoeuvring*, Delft: the
    jet of momentum theory; what a flow takes of a turning disc is C_s |n| U. `loss` is the share that is lost where
    both are at full; at less of its own the thruster loses a larger share, and may be driven backwards.
    """

    id: ClassVar[str] = "thruster_interaction"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "the jet of a neighbouring thruster takes thrust"
    needs: ClassVar[tuple[str, ...]] = ("neighbour_thrust",)
    covariates: ClassVar[tuple[str, ...]] = ("neighbour_thrust",)
    traits: ClassVar[Traits] = Traits(
        neighbour=True,
        shown_over="neighbour_thrust",
        shown_as="gain",
        told_by=(("", "three levels of each of the two thrusters"),),
        revealed_by="three levels of the neighbour at three levels of the thruster itself",
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
        jet = np.sqrt(neighbour / max(now.scale.neighbour or float(np.max(neighbour)), 1e-12))
        out: Floats = value - theta[0] * now.C * now.scale.driver * np.abs(now.x) * jet
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        full = f"{model.scale.neighbour:.6g}" if model.scale.neighbour else "max(abs(neighbour_thrust))"
        lost = f"{theta[0]:.6g} * {model.C:.6g} * {model.scale.driver:.6g}"
        return (f"F = F - {lost} * abs(x) * sqrt(abs(neighbour_thrust) / {full})  # {STANDS_IN}",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Thruster interaction: with the neighbour and itself at full {100 * theta[0]:.3g} % of the thrust is lost "
            "in its jet, and as the root of either thrust at less."
        )


FORMS = (ThrusterInteraction(),)
