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
    """(M,) measured rate / k minus x: a share of x that drifts or an amount that does, what foretells it better."""
    rows = history.rate_rows
    if history.rate is None or history.rate_sampled is None or rows.size < 2:
        return np.zeros_like(x)
    at = history.rate_sampled[rows]
    there = reconstructed(x, history.middle, history.rate_sampled)[rows]
    gap = _without_ticks(history.rate[rows] / k - there, np.broadcast_to(history.rate_lead, x.shape)[rows])
    amount, missed = calmed(gap, np.ones_like(gap))
    share, missed_by_share = calmed(gap, there)
    by_share = missed_by_share < missed
    out: Floats = np.interp(history.middle, at, share if by_share else amount)
    return x * out if by_share else out


def _without_ticks(gap: Floats, lead: Floats) -> Floats:
    """The gap (n,) less what the ticks of the command do within an interval, as far as the rotor follows them."""
    power = float(lead @ lead)
    followed = min(max(float(gap @ lead) / power, 0.0), 1.0) if power > 0 else 0.0
    return gap - followed * lead


def calmed(value: Floats, basis: Floats) -> tuple[Floats, float]:
    """Running coefficient of value on a basis (n,), and its leave-one-out error: over as many neighbours as err least.

    The noise of the rate would hide the coupling. One alone, as measured, errs by what a straight line through both
    neighbours would.
    """
    if value.size < LEAST_ROWS:
        return np.divide(value, basis, out=np.zeros_like(value), where=basis != 0), float(np.mean(value**2))
    power = np.concatenate([[0.0], np.cumsum(basis**2)])
    product = np.concatenate([[0.0], np.cumsum(basis * value)])
    index = np.arange(value.size)
    tiny = max(1e-9 * float(power[-1]) / value.size, 1e-300)
    alone = value[1:-1] - 0.5 * (value[2:] + value[:-2])
    best = np.divide(value, basis, out=np.zeros_like(value), where=basis**2 > tiny)
    error = float(np.mean(alone**2)) if basis.std() == 0 else np.inf
    for reach in REACHES:
        if 2 * reach + 1 > value.size // 4:
            break
        low, high = np.maximum(index - reach, 0), np.minimum(index + reach + 1, value.size)
        b2, by = power[high] - power[low], product[high] - product[low]
        others = np.maximum(b2 - basis**2, tiny)
        missed = float(np.mean((value - basis * (by - basis * value) / others) ** 2))
        if missed < error:
            best, error = by / np.maximum(b2, tiny), missed
    return best, error


LEAST_ROWS = 8
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
