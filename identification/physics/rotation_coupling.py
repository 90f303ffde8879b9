"""Thrust follows the measured rate n, not the command: x moves from V to n / k."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identification.physics.filters import reconstructed
from identification.physics.history import History
from identification.physics.term import Moment, Parameter, Scale, Stage
from identification.recording import Floats


def slip(history: History, x: Floats, k: float) -> Floats:
    """(M,) measured rate / k minus x: taken where the rate was measured, a straight line between."""
    rows = history.rate_rows
    if history.rate is None or history.rate_sampled is None or rows.size < 2:
        return np.zeros_like(x)
    there = reconstructed(x, history.middle, history.rate_sampled)[rows]
    out: Floats = np.interp(history.middle, history.rate_sampled[rows], calmed(history.rate[rows] / k - there))
    return out


def calmed(value: Floats) -> Floats:
    """Running mean over as many neighbours as foretell a value best (leave-one-out): noise would hide the coupling."""
    total = np.concatenate([[0.0], np.cumsum(value)])
    index = np.arange(value.size)
    best, error = value, np.inf
    for reach in REACHES:
        if 2 * reach + 1 > value.size // 4:
            break
        low, high = np.maximum(index - reach, 0), np.minimum(index + reach + 1, value.size)
        many = high - low
        mean = (total[high] - total[low]) / many
        missed = float(np.mean(((value - mean) * many / np.maximum(many - 1, 1)) ** 2))
        if missed < error:
            best, error = mean, missed
    return best


REACHES = (1, 2, 4, 8, 16, 32, 64, 128)
"""Rows on either side."""


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
        out: Floats = value + theta[0] * slip(now.history, value, now.history.rate_per_driver)
        return out

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        return (
            "Rotation coupling: thrust follows the measured rotation rate (share "
            f"{theta[0]:.2f}), which the command alone does not give; model it in n."
        )


FORMS = (RotationCoupling(),)
