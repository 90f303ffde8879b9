"""Voltage lost in the winding: |V| = e + loss e^2, e the back-EMF (motor balance, current as e^2).

Of what is asked a share in proportion to V is lost. So is it in any resistance in series behind a linear amplifier;
behind a switching drive the share goes as V^3 (supply_sag, loaded).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.digits import beside
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class WindingResistance:
    """Voltage lost in the winding: |V| = e + loss e^2, e the back-EMF (motor balance, current as e^2)."""

    id: ClassVar[str] = "winding_resistance"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "voltage is lost in the winding as the current grows"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    traits: ClassVar[Traits] = Traits(
        winding="loss",
        told_by=(("rotation_rate", "the measured rotation rate"), ("current", "the measured current")),
        revealed_by="the measured rotation rate or current at 0.3, 0.6 and 1.0 of the highest level",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (
            Parameter(
                "loss", f"1/{scale.driver_unit}", 0.0, 5.0 / scale.driver, 0.0, told="voltage lost in the winding"
            ),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share / scale.driver,) for share in (0.02, 0.2, 0.8))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        loss = theta[0]
        if loss <= 0:
            return value
        out: Floats = np.sign(value) * 2 * np.abs(value) / (1 + np.sqrt(1 + 4 * loss * np.abs(value)))
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V = model.symbol
        return (f"{V} = 2 * {V} / (1 + sqrt(1 + 4 * {theta[0]:.6g} * abs({V})))",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        e = 2 / (1 + (1 + 4 * theta[0] * scale.driver) ** 0.5)
        return (
            f"Winding resistance: of {scale.driver:.3g} {scale.driver_unit} only {beside(100 * e, 100.0)} "
            "% turns the motor; the rest is lost in the winding, as the current grows."
        )


FORMS = (WindingResistance(),)
