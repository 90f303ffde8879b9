"""Mass on a spring: the reading rings, y'' + 2 z w y' + w^2 y = w^2 F."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Dynamics, Traits
from identification.recording import Floats
from identification.run_history.filters import resonant

LOWEST = 0.5
"""Hz: slower than any stand that thrusters are tried on; a fit goes on from there."""
LONG = 0.03
"""Damping of what rings on for five periods: trials between which such ringing stays in phase are as close as that."""
TRIED = 18
"""Frequencies to look for it with."""
HIGHEST = 300.0
"""Hz: what rings faster is not seen by a load cell."""


def _dynamics(_term: StandResonance, theta: tuple[float, ...], _largest: float) -> Dynamics:
    return Dynamics(ring=(theta[0], theta[1], theta[2]))


@dataclass(frozen=True, slots=True)
class StandResonance:
    """Mass on a spring: the reading rings, y'' + 2 z w y' + w^2 y = w^2 F."""

    id: ClassVar[str] = "stand_resonance"
    stage: ClassVar[Stage] = "stand"
    physics: ClassVar[str] = "the stand rings after a step"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        delays=True,
        from_data=True,
        frequency="frequency",
        dynamics=_dynamics,
        shown_over="time_since_step",
        shown_as="step",
        revealed_by="a spectrum of the ringing after a step, at two levels",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (
            Parameter("compliance", "1", 0.0, 1.0, 0.0, whole=True, told="share that rings"),
            Parameter("frequency", "Hz", 0.1, min(0.45 / scale.interval, HIGHEST)),
            Parameter("damping", "1", 0.005, 0.4),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        highest = min(0.4 / scale.interval, HIGHEST)
        return tuple((1.0, float(f), 0.1) for f in np.geomspace(LOWEST, max(highest, 0.6), TRIED))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        # ringing that is out of phase after a cycle or two looks like nothing: no slope leads there, and no blunt trial
        most = self.parameters(scale)[1].high
        near = values[1] * np.geomspace(0.6, 1.6, 31)
        found = [(values[0], float(min(f, most)), damping) for f in near for damping in (LONG, 0.1)]
        anywhere = np.geomspace(LOWEST, most, max(round(float(np.log(most / LOWEST)) / (1.3 * LONG)), 2))
        return *found, *((values[0], float(f), LONG) for f in anywhere)

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        rung = resonant(value, now.history.dt, theta[1], theta[2])
        out: Floats = value + theta[0] * (rung - value)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        compliance, frequency, damping = theta
        w = 2 * np.pi * frequency
        pull = f"{w**2:.6g} * (F - ringing) - {2 * damping * w:.6g} * moving"
        return (
            "d(ringing)/dt = moving, ringing(0) = 0",
            f"d(moving)/dt = {pull}, moving(0) = 0",
            f"F = F + {compliance:.6g} * (ringing - F)",
        )

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Stand resonance: the stand rings at {theta[1]:.3g} Hz with {100 * theta[2]:.2g} % of critical damping."


FORMS = (StandResonance(),)
