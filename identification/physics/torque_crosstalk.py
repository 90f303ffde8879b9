"""The cell feels the torque: as it was measured, or + c x^2, even in the direction: its odd part is lost in C."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.equation import signed
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Proxy, Traits
from identification.recording import Floats

TORQUE = "torque"
MOST = 0.1
"""Of full thrust: what is larger is the propeller's own, or the noise of a torque that follows the thrust."""


@dataclass(frozen=True, slots=True)
class TorqueCrosstalk:
    """No torque was recorded: + c x^2, even in the direction; its odd part can not be told from C."""

    id: ClassVar[str] = "torque_crosstalk"
    stage: ClassVar[Stage] = "stand"
    physics: ClassVar[str] = "the cell feels the torque of the propeller"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage", "direction")
    traits: ClassVar[Traits] = Traits(
        even=True,
        rare=True,
        seen_by=TORQUE,
        proxy=Proxy(TORQUE, "no torque was recorded", "the square of the rotor's rate as the model has it"),
        told_by=((TORQUE, "the torque channel"), ("", "dead weights on the cell")),
        revealed_by="dead weights on the load cell, or a torque channel",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (
            Parameter(
                "coefficient",
                f"N/{scale.driver_unit}^2",
                -MOST * scale.thrust / scale.driver**2,
                MOST * scale.thrust / scale.driver**2,
                0.0,
                told="share of the torque",
            ),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.01 * scale.thrust / scale.driver**2,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * now.x**2
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = F {signed(theta[0])} * x ** 2",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Torque cross-talk: the cell shows {theta[0]:.3g} N/{scale.driver_unit}^2 "
            "of the same sign in both directions; check its mounting with dead weights."
        )


@dataclass(frozen=True, slots=True)
class MeasuredTorque:
    """+ c Q, Q the recorded torque, signed: seen where Q is no multiple of x|x|, else it is lost in C."""

    id: ClassVar[str] = "torque_crosstalk"
    stage: ClassVar[Stage] = "stand"
    physics: ClassVar[str] = "the cell feels the torque of the propeller"
    needs: ClassVar[tuple[str, ...]] = (TORQUE,)
    covariates: ClassVar[tuple[str, ...]] = (TORQUE,)
    traits: ClassVar[Traits] = Traits(
        even=True,
        seen_by=TORQUE,
        told_by=((TORQUE, "the torque channel"), ("", "dead weights on the cell")),
        revealed_by="dead weights on the load cell, with and without a moment",
    )
    form: ClassVar[str] = "measured"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = MOST * _lever(scale)
        return (Parameter("coefficient", "1/m", -most, most, 0.0, told="share of the torque"),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.01 * _lever(scale),),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * now.history.others[TORQUE]
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = F {signed(theta[0])} * torque",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        share = 100 * abs(theta[0]) / _lever(scale)
        return (
            f"Torque cross-talk: the cell shows {theta[0]:.3g} N per N m of the measured torque, {share:.2g} % of full "
            "thrust at full torque; take that off, and check the cell with a pure moment."
        )


def _lever(scale: Scale) -> float:
    """1/m: full thrust over full torque."""
    return scale.thrust / scale.torque if scale.torque > 0 else np.inf


FORMS = (TorqueCrosstalk(), MeasuredTorque())
