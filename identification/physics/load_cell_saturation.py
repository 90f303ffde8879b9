"""Cell or amplifier clips: clip(F, -limit, limit)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import ndtr

from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


def _excess(z: Floats) -> Floats:
    """Mean of max(z + e, 0) for a normal deviate e."""
    out: Floats = z * ndtr(z) + np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)
    return out


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
        return (Parameter("limit", "N", 0.1 * scale.reading, 1.3 * scale.reading, 1.3 * scale.reading),)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return tuple((share * scale.reading,) for share in (0.99, 0.95, 0.88, 0.75, 0.6))

    def finer(self, values: tuple[float, ...], scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ()

    def apply(self, value: Floats, now: Moment, theta: tuple[float, ...]) -> Floats:
        reading = value + now.tare
        if now.scale.noise <= 0:
            clipped: Floats = np.clip(reading, -theta[0], theta[0]) - now.tare
            return clipped
        # the mean of noisy samples that clip one by one
        over = (reading - theta[0]) / now.scale.noise
        under = (-theta[0] - reading) / now.scale.noise
        out: Floats = value - now.scale.noise * (_excess(over) - _excess(under))
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Load-cell saturation: readings end at +-{theta[0]:.4g} N; change the range of the amplifier or the cell."
        )


FORMS = (LoadCellSaturation(),)
