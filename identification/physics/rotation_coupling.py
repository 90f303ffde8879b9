"""Thrust follows the measured rate n, not the command: x moves from V to n / k."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class RotationCoupling:
    """Thrust follows the measured rate n, not the command: x moves from V to n / k."""

    id: ClassVar[str] = "rotation_coupling"
    stage: ClassVar[Stage] = "rotor"
    physics: ClassVar[str] = "thrust follows the measured rotation rate, and the rate does not follow the command"
    needs: ClassVar[tuple[str, ...]] = ("rotation_rate",)
    coordinates: ClassVar[tuple[str, ...]] = ("rotation_rate",)
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("share", "1", 0.0, 1.2, 0.0),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.1,), (1.0,))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        measured = now.history.others["rotation_rate"] / now.history.rate_per_driver
        out: Floats = value + theta[0] * (measured - value)
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return f"Rotation coupling: thrust follows the measured rotation rate (share {theta[0]:.2f}), which the command alone does not give; model it in n."


FORMS = (RotationCoupling(),)
