"""The cell is not straight: F + e F|F|, or F + e F^3."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from identification.physics.equation import signed
from identification.physics.term import WEIGHED, EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats

MOST = 0.12
"""Of the largest thrust. A cell in order is straight within 0.0002 to 0.002 of its range; one that is off by an eighth
is broken, and a dead weight shows it at once."""


@dataclass(frozen=True, slots=True)
class LoadCellNonlinearity:
    """The cell is not straight: F + e F|F|, or F + e F^3."""

    id: ClassVar[str] = "load_cell_nonlinearity"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the load cell is not straight"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("thrust",)
    traits: ClassVar[Traits] = Traits(
        told_by=(("", "dead weights on the cell"),), revealed_by="dead weights on the load cell"
    )
    form: Literal["quadratic", "cubic"] = "quadratic"

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        unit = "1/N^2" if self.form == "cubic" else "1/N"
        most = self._most(scale)
        return (Parameter("coefficient", unit, -most, most, 0.0, told="bend"),)

    def _most(self, scale: Scale) -> float:
        """1/N or 1/N^2: of a broken cell, or what dead weights left possible."""
        power, known = (2, scale.cell_cubic) if self.form == "cubic" else (1, scale.cell_odd)
        most = MOST / scale.thrust**power
        return min(most, WEIGHED * known) if known > 0 else most

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        power = 2 if self.form == "cubic" else 1
        return ((min(0.02 / scale.thrust**power, self._most(scale)),),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        bend = value**2 if self.form == "cubic" else np.abs(value)
        out: Floats = value * (1 + theta[0] * bend)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        bend = "F ** 2" if self.form == "cubic" else "abs(F)"
        return (f"F = F * (1 {signed(theta[0])} * {bend})",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        power = 2 if self.form == "cubic" else 1
        return (
            f"Load-cell non-linearity: at {scale.thrust:.3g} N the cell shows "
            f"{100 * theta[0] * scale.thrust**power:+.2g} %; check it with dead weights."
        )


FORMS = (
    LoadCellNonlinearity("quadratic"),
    LoadCellNonlinearity("cubic"),
)
