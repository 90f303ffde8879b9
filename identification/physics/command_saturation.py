"""The drive clips: V_eff = clip(V, -limit, limit)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class CommandSaturation:
    """The drive clips: V_eff = clip(V, -limit, limit)."""

    id: ClassVar[str] = "command_saturation"
    stage: ClassVar[Stage] = "command"
    physics: ClassVar[str] = "the drive gives no more than a limit"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("command_voltage",)
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("limit", scale.driver_unit, 0.2 * scale.driver, scale.driver, scale.driver),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.driver,) for share in (0.97, 0.92, 0.85, 0.75, 0.6))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        out: Floats = np.clip(value, -theta[0], theta[0])
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Command saturation: the drive gives no more than {theta[0]:.3g} "
            f"{scale.driver_unit}; higher commands change nothing."
        )


FORMS = (CommandSaturation(),)
