"""Cell or amplifier clips: clip(F, -limit, limit)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import ndtr

from identification.physics.history import TAIL, History
from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats

FAR = 8.0
"""Standard deviations of the noise: what is farther from the limit clips always, or never."""
LEAST_MOVE = 1e-6
"""Of the limit: what moves less within an interval stands still."""
LEAST_BLUR = 0.01
"""The same, of the noise."""


def half_moved(history: History, C: float, x: Floats) -> Floats:
    """(M,) N: half of how far the force moves within each interval, by the variance of the driver there."""
    out: Floats = C * np.abs(x) * np.sqrt(12 * np.abs(history.excess))
    return out


def below(reading: Floats, limit: float, half: Floats) -> Floats:
    """(M,) share of each interval below the limit, from its clipped mean: limit - half share^2 of an even motion."""
    short = np.maximum(limit - np.abs(reading), 0.0)
    out: Floats = np.sqrt(np.minimum(short / np.maximum(half, LEAST_MOVE * limit), 1.0))
    return out


def _beyond(z: Floats, half: Floats, noise: float) -> Floats:
    """Mean of max(z + u + e, 0): u even within +-half, e normal of standard deviation `noise`."""
    out = np.where(z > 0, z, 0.0)
    near = np.abs(z) < half + FAR * noise
    u, h = z[near], half[near]
    out[near] = (_integral(u + h, noise) - _integral(u - h, noise)) / (2 * h)
    return out


def _integral(z: Floats, noise: float) -> Floats:
    """Mean of max(z + e, 0)^2 / 2."""
    if noise <= 0:
        hard: Floats = 0.5 * np.maximum(z, 0.0) ** 2
        return hard
    s = z / noise
    out: Floats = 0.5 * noise**2 * ((1 + s**2) * ndtr(s) + s * np.exp(-0.5 * s**2) / np.sqrt(2 * np.pi))
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
        # the mean of noisy samples that clip one by one while the force moves within the interval
        noise, tails = now.history.scatter or (now.scale.noise, 0.0)
        half = np.maximum(half_moved(now.history, now.C, now.x), max(LEAST_MOVE * theta[0], LEAST_BLUR * noise))
        out = value.copy()
        for share, std in ((1 - tails, noise), (tails, TAIL * noise)):
            if share > 0:
                over = value + now.tare - theta[0]
                under = -theta[0] - value - now.tare
                out -= share * (_beyond(over, half, std) - _beyond(under, half, std))
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            f"Load-cell saturation: readings end at +-{theta[0]:.4g} N; change the range of the amplifier or the cell."
        )


FORMS = (LoadCellSaturation(),)
