"""Cell or amplifier clips: clip(F, -limit, limit)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


@dataclass(frozen=True, slots=True)
class LoadCellSaturation:
    """Cell or amplifier clips: clip(F, -limit, limit)."""

    id: ClassVar[str] = "load_cell_saturation"
    stage: ClassVar[Stage] = "cell"
    physics: ClassVar[str] = "the load cell or its amplifier clips"
    needs: ClassVar[tuple[str, ...]] = ()
    coordinates: ClassVar[tuple[str, ...]] = ("thrust",)
    form: ClassVar[str] = ""

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        return (Parameter("limit", "N", 0.1 * scale.thrust, 1.3 * scale.thrust, 1.3 * scale.thrust),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.thrust,) for share in (0.96, 0.9, 0.8, 0.65, 0.5))

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        out: Floats = np.clip(value, -theta[0], theta[0])
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Load-cell saturation: readings end at +-{theta[0]:.4g} N; change the range of the amplifier or the cell."
        )


FORMS = (LoadCellSaturation(),)
