"""The cell feels the torque: + c x^2, even in the direction; its odd part can not be told from C."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class TorqueCrosstalk:
    """The cell feels the torque: + c x^2, even in the direction; its odd part can not be told from C."""

    id: ClassVar[str] = "torque_crosstalk"
    stage: ClassVar[Stage] = "stand"
    physics: ClassVar[str] = "the cell feels the torque of the propeller"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("command_voltage", "direction")
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (
            Parameter(
                "coefficient",
                f"N/{scale.driver_unit}^2",
                -0.1 * scale.thrust / scale.driver**2,
                0.1 * scale.thrust / scale.driver**2,
                0.0,
            ),
        )

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.01 * scale.thrust / scale.driver**2,),)

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        out: Floats = value + theta[0] * now.x**2
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Torque cross-talk: the cell shows {theta[0]:.3g} N/{scale.driver_unit}^2 "
            "of the same sign in both directions; check its mounting with dead weights."
        )


FORMS = (TorqueCrosstalk(),)
