"""Thrust follows the measured rate n, not the command: x moves from V to n / k."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from identification.physics.term import EquationContext, Parameter, Scale, Stage, TermContext
from identification.physics.traits import Traits
from identification.recording import Floats
from identification.run_history.slip import slip


@dataclass(frozen=True, slots=True)
class RotationCoupling:
    """Thrust follows the measured rate n, not the command: x moves from V to n / k."""

    id: ClassVar[str] = "rotation_coupling"
    stage: ClassVar[Stage] = "rotor"
    physics: ClassVar[str] = "thrust follows the measured rotation rate, and the rate does not follow the command"
    needs: ClassVar[tuple[str, ...]] = ("rotation_rate",)
    covariates: ClassVar[tuple[str, ...]] = ("rotation_rate",)
    traits: ClassVar[Traits] = Traits(
        moving=True,
        follows_rate="share",
        shown_over="rotation_rate",
        told_by=(("rotation_rate", "the measured rotation rate"),),
        revealed_by="the same command at another load or supply, the rotation rate measured",
    )
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("share", "1", 0.0, 1.2, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.1,), (1.0,))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: TermContext, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * slip(now.run, value, now.history.rate_per_driver)
        return out

    def equation(self, theta: tuple[float, ...], model: EquationContext) -> tuple[str, ...]:
        V, k = model.symbol, f"{model.rate_per_driver:.6g}"
        noise = f"without the noise of the rate; C is of {k} rev/s per {model.scale.driver_unit}"
        return (f"x = {V} + {theta[0]:.6g} * (rotation_rate / {k} - {V})  # {noise}",)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Rotation coupling: thrust follows the measured rotation rate n by {100 * theta[0]:.0f} %, where the "
            "command alone does not tell it; model it in n."
        )


FORMS = (RotationCoupling(),)
