"""Thrust breaks down above a rate: T (1 - k e) or, setting in gently, T (1 - (k e)^2), e = max(|x| - onset, 0)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.digits import percent
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Proxy, Traits
from identification.recording import Floats

RATE = Proxy("rotation_rate", "no rotation rate was recorded", "the voltage, as the steady rate that goes with it,")

MOST_LOST = 0.9
"""Of the thrust at the largest driver: as much as ventilation takes at most, which takes more (0.7 to 0.9: Kozlowska,
Steen and Koushan 2009, Classification of different type of propeller ventilation)."""


def _too_much(term: Cavitation, theta: tuple[float, ...], driver: float) -> bool:
    return term.lost(theta, driver) > MOST_LOST


@dataclass(frozen=True, slots=True)
class Cavitation:
    """Thrust breaks down above a rate: T (1 - k e) or, setting in gently, T (1 - (k e)^2), e = max(|x| - onset, 0)."""

    id: ClassVar[str] = "cavitation"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "thrust breaks down above a rate"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    traits: ClassVar[Traits] = Traits(
        proxy=RATE,
        too_much=_too_much,
        told_by=(("rotation_rate", "the measured rotation rate"), ("", "another depth")),
        revealed_by="high levels at another depth; the measured rotation rate",
    )
    form: Literal["linear", "square"] = "linear"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (
            Parameter("slope", f"1/{scale.driver_unit}", 0.0, 8.0 / scale.driver, 0.0),
            Parameter("onset", scale.driver_unit, 0.4 * scale.driver, 0.98 * scale.driver),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        slope = (0.3 if self.form == "linear" else 0.8) / scale.driver
        return tuple((slope, share * scale.driver) for share in (0.45, 0.6, 0.75, 0.88))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        lost = theta[0] * np.maximum(np.abs(now.x) - theta[1], 0.0)
        out: Floats = value * np.maximum(1 - (lost if self.form == "linear" else lost**2), 0.0)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        lost = f"{theta[0]:.6g} * maximum(abs(x) - {theta[1]:.6g}, 0)"
        return (f"F = F * maximum(1 - {lost if self.form == 'linear' else f'({lost}) ** 2'}, 0)",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Cavitation: above {theta[1]:.3g} {scale.driver_unit} thrust breaks down; "
            f"{percent(self.lost(theta, scale.driver))} % is lost at {scale.driver:.3g} {scale.driver_unit}."
        )

    def lost(self, theta: tuple[float, ...], driver: float) -> float:
        """Share of the thrust at a driver."""
        beyond = theta[0] * max(driver - theta[1], 0.0)
        return min(beyond if self.form == "linear" else beyond**2, 1.0)


FORMS = (Cavitation("linear"), Cavitation("square"))
