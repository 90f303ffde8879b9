"""Channels not on one clock, or a transport delay: F(t - d)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Dynamics, Traits
from identification.recording import Floats

FINER = tuple(np.geomspace(0.2, 5.0, 17).tolist())
"""Of a trial delay: from one trial to the next."""


def _dynamics(_term: TimeSkew, theta: tuple[float, ...], _largest: float) -> Dynamics:
    return Dynamics(delay=theta[0])


@dataclass(frozen=True, slots=True)
class TimeSkew:
    """Channels not on one clock, or a transport delay: F(t - d)."""

    id: ClassVar[str] = "time_skew"
    stage: ClassVar[Stage] = "stand"
    physics: ClassVar[str] = "force and command are not on one clock"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("time_since_step",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        delays=True,
        own_clock=True,
        delay="delay",
        dynamics=_dynamics,
        shown_over="time_since_step",
        shown_as="step",
        told_by=(("rotation_rate", "the measured rotation rate"),),
        revealed_by="small and large steps, sampled fast: a delay keeps the shape of the step",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("delay", "s", -2.0, 2.0, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((d,) for d in (0.004, 0.02, 0.1, 0.4))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        """Steps of the command between two samples make a staircase of the delay: a slope finds no way along it."""
        return tuple((sign * values[0] * factor,) for sign in (1.0, -1.0) for factor in FINER)

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        return now.run.delayed(value, theta[0])

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = delayed(F, {theta[0]:.6g})  # F so many s before",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        ms = f"{1000 * abs(theta[0]):.3g} ms"
        if theta[0] > 0:
            return (
                f"Time skew: the force arrives {ms} after the command that causes it; a pulse on both channels tells "
                "whether that is clocks, transport or an amplifier that smooths."
            )
        return (
            f"Time skew: by its stamps the force comes {ms} before the command that causes it, so the clocks differ or "
            "the command is stamped late; a pulse on both channels tells by how much."
        )


FORMS = (TimeSkew(),)
