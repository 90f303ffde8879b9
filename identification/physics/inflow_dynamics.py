"""Water in the duct must be accelerated: T + C|x| share (x - u); u follows x with a lag, or by its momentum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.digits import percent
from identification.physics.equation import follows
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.rotor_lag import Rotor

QUICKEST = 0.004
"""s, half of the least that a small thruster has."""
SLOW_ENOUGH = 0.05
"""s: is looked for however seldom the thrust was sampled."""


def quickest(scale: Scale) -> float:
    """s: an overshoot that is over within a sample has a size, but no time of its own."""
    return min(max(QUICKEST, scale.spacing), SLOW_ENOUGH)


@dataclass(frozen=True, slots=True)
class InflowDynamics:
    """Water in the duct must be accelerated: T + C|x| share (x - u).

    First order: u' = (x - u)/tau. Momentum: u' = (x|x| - u|u|)/(2 tau x_max), which is slower at less. The column
    takes L/(4 u) to follow: 8 to 17 ms at a disc of 76 mm, 40 to 80 ms at 300 mm (Bachmayer, Whitcomb and Grosenbaugh
    2000), so that the least time is that which the samples can show.
    """

    id: ClassVar[str] = "inflow_dynamics"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "the water in the duct must be accelerated first, so thrust overshoots"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        delays=True,
        quick="time_constant",
        shown_over="time_since_step",
        shown_as="step",
        revealed_by="steps of several sizes: overshoot that scales with the flow, not with the rotor",
    )
    form: Literal["", "momentum"] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("share", "1", 0.0, 3.0, 0.0), Parameter("time_constant", "s", quickest(scale), 5.0))

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((0.1, tau) for tau in (0.01, 0.03, 0.1, 0.3, 1.0, 3.0) if tau > 1.5 * quickest(scale))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        rotor = Rotor(0.5 / (theta[1] * now.scale.driver), 0.0) if self.form else Rotor(0.0, 1 / theta[1])
        u = now.run.follower(now.settled, rotor)
        out: Floats = value + now.C * np.abs(now.x) * theta[0] * (now.x - u)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        share, tau = theta
        if self.form:
            rate = f"(x * abs(x) - inflow * abs(inflow)) / (2 * {tau:.6g} * {model.scale.driver:.6g})"
            water = f"d(inflow)/dt = {rate}, inflow(0) = 0"
        else:
            water = follows("inflow", "x", tau)
        return water, f"F = F + {share:.6g} * {model.C:.6g} * abs(x) * (x - inflow)"

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        slower = "" if not self.form else f" at {scale.driver:.3g} {scale.driver_unit}, slower at less"
        return (
            f"Inflow dynamics: after a step thrust overshoots by {percent(theta[0])} "
            f"%, until the water has followed (time constant {theta[1]:.2g} s{slower})."
        )


FORMS = (InflowDynamics(), InflowDynamics("momentum"))
