"""Thrust grows as |V|^p, not as its square (Reynolds number, open-water curve), or as what the drive regulates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.digits import beside
from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats

LEAST = 0.5
"""Below the least that a drive makes: 2 where speed or voltage is regulated, 1 for torque, 2/3 for power
(Smogeli 2006, *Control of marine propellers*, NTNU 2006:187), and something lost beside it."""

BY_WATER = 1.5
"""A propeller by itself has 2.0 to 2.1, by its Reynolds number: what is so far below is the drive."""
REGULATED = (
    "a drive that regulates torque makes it 1, one that regulates power 2/3: rate and current recorded at ten levels "
    "show which"
)


@dataclass(frozen=True, slots=True)
class Exponent:
    """Thrust grows as |V|^p, not as its square: 2 - p small by the Reynolds number, p = 1 or 2/3 by the drive."""

    id: ClassVar[str] = "exponent"
    stage: ClassVar[Stage] = "hydro"
    physics: ClassVar[str] = "thrust does not grow with the square"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    traits: ClassVar[Traits] = Traits(refers=True, revealed_by="levels over the whole range, evenly in thrust")
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("exponent", "1", LEAST, 3.5, 2.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((1.95,), (1.7,), (2.3,), (1.0,), (0.7,))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        size = np.abs(now.x) / now.scale.driver
        out: Floats = value * np.maximum(size, 1e-9) ** (theta[0] - 2)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        size = f"maximum(abs(x) / {model.scale.driver:.6g}, 1e-9)"
        return (f"F = F * {size} ** ({theta[0]:.6g} - 2)",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        hint = f"; {REGULATED}" if theta[0] < BY_WATER and scale.driver_unit == "V" else ""
        return f"Exponent: thrust grows as |V|^{beside(theta[0], 2.0, 2)}, not as V^2{hint}."


FORMS = (Exponent(),)
