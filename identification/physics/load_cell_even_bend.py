"""The cell does not mirror pull and push: F + e F^2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from identification.physics.equation import signed
from identification.physics.term import WEIGHED, EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats

MOST = 0.05
"""Of full thrust: 25 times a poor cell's 0.2 % of range; a larger difference of the directions is the propeller's."""


@dataclass(frozen=True, slots=True)
class LoadCellEvenBend:
    """The cell does not mirror pull and push: F + e F^2."""

    id: ClassVar[str] = "load_cell_even_bend"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the load cell bends the same way in pull and in push"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("thrust", "direction")
    traits: ClassVar[Traits] = Traits(
        told_by=(("", "dead weights on the cell"),),
        revealed_by="dead weights on the load cell, in pull and in push",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = self._most(scale)
        return (Parameter("coefficient", "1/N", -most, most, 0.0, told="bend"),)

    def _most(self, scale: Scale) -> float:
        """1/N: of a broken cell, or what dead weights left possible."""
        most = MOST / scale.thrust
        return min(most, WEIGHED * scale.cell_even) if scale.cell_even > 0 else most

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((min(0.01 / scale.thrust, self._most(scale)),),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * value**2
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        return (f"F = F {signed(theta[0])} * F ** 2",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Load-cell even bend: at {scale.thrust:.3g} N of either sign the cell is off by "
            f"{theta[0] * scale.thrust**2:+.2g} N; check it with dead weights in pull and in push."
        )


FORMS = (LoadCellEvenBend(),)
