"""Friction or play in the load path: play operator of half width w."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.filters import play


@dataclass(frozen=True, slots=True)
class Hysteresis:
    """Friction or play in the load path: play operator of half width w."""

    id: ClassVar[str] = "hysteresis"
    stage: ClassVar[Stage] = "stand"
    physics: ClassVar[str] = "friction or play in the load path"
    needs: ClassVar[tuple[str, ...]] = ()
    covariates: ClassVar[tuple[str, ...]] = ("previous_voltage", "direction_of_change")
    traits: ClassVar[Traits] = Traits(
        moving=True, shown_as="turn", revealed_by="slow triangles, up and down through the same levels"
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("half_width", "N", 0.0, 0.3 * scale.thrust, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.thrust,) for share in (0.003, 0.01, 0.04))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        return play(value, theta[0])

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        w = f"{theta[0]:.6g}"
        return (f"F = play(F, {w})  # y = min(max(y, F - {w}), F + {w}) from one instant to the next, y = 0 before",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Hysteresis: up- and down-sweep differ by {2 * theta[0]:.3g} N; friction or play in the load path."


FORMS = (Hysteresis(),)
