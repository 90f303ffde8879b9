"""How much of the start of a hold to leave out, found from its own data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.estimation.even_noise import MIN_SAMPLES, fit_noise, leverage
from identification.estimation.tails import student_quantile
from identification.recording import Floats

BATCH = 5
"""Samples averaged before the rule is applied: MSER-5 (White, Cobb, Spratt, Winter Simulation Conference 2000)."""
MSER_CERTAIN = 0.4
"""A cut that lowers MSER's statistic to this share of the uncut one is believed without a further test."""
LONGEST_CUT = 0.5
"""This share of a hold may be left out; one that asks for more is still settling in the rest of it."""
F_SHIFT = 14.0
"""F statistic from which a different start is believed, correlation allowed for: 3.7 standard deviations, one in 5000,
since the place of the cut and the time constant were searched for."""
BIAS_SHARE = 0.1
"""What is left of the exponential may shift the mean by this share of its (white) standard error."""


@dataclass(frozen=True, slots=True)
class Settling:
    """`cut` samples to leave out; `settled` False when the rest still settles; `time_constant` in samples."""

    cut: int
    settled: bool
    time_constant: float | None


def mser_cut(values: Floats) -> int:
    """Samples to leave out by MSER-5: the cut that minimises sum((y - mean)^2) / (n - d)^2 over the rest.

    >>> mser_cut(np.concatenate([np.linspace(9, 0, 20), np.tile([0.1, -0.1], 90)]))
    20
    """
    size = min(BATCH, max(1, values.size // 20))
    count = values.size // size
    if count < 4:
        return 0
    batch = values[values.size - count * size :].reshape(count, size).mean(axis=1)[::-1]
    n = np.arange(1, count + 1)
    batch = batch - batch.mean()
    spread = np.cumsum(batch**2) - np.cumsum(batch) ** 2 / n
    statistic = (np.maximum(spread, 0.0) / n**2)[::-1]
    allowed = int(count * LONGEST_CUT)
    best = int(np.argmin(statistic[: allowed + 1]))
    cut = min(best * size + values.size - count * size, values.size // 2)
    certain = statistic[best] <= MSER_CERTAIN * statistic[0]
    return cut if best > 0 and (certain or _shifted(values, cut)) else 0


def _correlation(values: Floats) -> float:
    """(1 + r) / (1 - r), r the lag-1 correlation: by this factor first-order noise widens the variance of means."""
    centred = values - values.mean()
    power = float(centred @ centred)
    r = float(centred[1:] @ centred[:-1]) / power if power > 0 else 0.0
    r = min(max(r + (1 + 3 * r) / values.size, 0.0), 0.98)  # Marriott and Pope's correction for the bias of r
    return (1 + r) / (1 - r)


def _believed(size: float, residual: Floats, column: Floats) -> bool:
    """Is a least-squares `size` of a zero-mean `column` more than slow noise makes? `residual`: what it leaves.

    White noise upon slow noise has a small lag-1 correlation and still long lumps: the whole spectrum is asked.
    """
    if residual.size < MIN_SAMPLES:
        return False
    power = float(column @ column)
    std, dof = fit_noise(residual, leverage(column[:, None] / np.sqrt(power))).combination_std(column / power)
    return bool(abs(size) > np.sqrt(F_SHIFT) / 1.96 * float(student_quantile(0.975, dof)) * std)


def _shifted(values: Floats, cut: int) -> bool:
    """Is the mean of the first `cut` samples different from that of the rest?"""
    head, rest = values[:cut], values[cut:]
    variance = float(rest.var(ddof=1)) * _correlation(rest) * (1 / cut + 1 / rest.size)
    shift = float(head.mean() - rest.mean())
    if shift**2 <= F_SHIFT * variance:
        return False
    step = np.where(np.arange(values.size) < cut, 1.0, 0.0)
    residual = np.concatenate([head - head.mean(), rest - rest.mean()])
    return _believed(shift, residual, step - step.mean())


def exponential_cut(values: Floats) -> tuple[int, float | None]:
    """Samples after which an exponential approach shifts the mean by less than `BIAS_SHARE` of its standard error.

    Fits a + b exp(-i / T) by variable projection over a grid of T up to a sixth of the hold; (0, None) when no
    exponential is there.
    """
    n = values.size
    if n < 12:
        return 0, None
    constants = np.geomspace(0.7, n / 6, 24)
    column = np.exp(-np.arange(n) / constants[:, None])
    column -= column.mean(axis=1, keepdims=True)
    centred = values - values.mean()
    power = np.einsum("kn,kn->k", column, column)
    amplitude = (column @ centred) / power
    gained = amplitude**2 * power
    best = int(np.argmax(gained))
    rest = centred - amplitude[best] * column[best]
    left = float(rest @ rest)
    if gained[best] == 0.0 or gained[best] * (n - 3) <= F_SHIFT * left * _correlation(rest):
        return 0, None
    if not _believed(float(amplitude[best]), rest, column[best]):
        return 0, None
    constant, start = float(constants[best]), abs(float(amplitude[best]))
    noise = max(float(np.sqrt(left / (n - 3))), 1e-6 * start)
    ratio = start * constant / (BIAS_SHARE * noise * np.sqrt(n / 2))
    return int(np.ceil(constant * max(np.log(ratio), 0.0))), constant


def settle(values: Floats) -> Settling:
    """The longer of both cuts. Pure noise is left whole in most cases.

    >>> i = np.arange(200)
    >>> result = settle(20 * np.exp(-i / 8) + np.where(i % 2, 0.1, -0.1))
    >>> (40 < result.cut < 90, result.settled)
    (True, True)
    """
    exponential, constant = exponential_cut(values)
    mser = mser_cut(values)
    half = int(values.size * LONGEST_CUT)
    if exponential > half:
        return Settling(half, False, constant)
    at_limit = mser > 0 and mser >= half - BATCH and exponential < mser
    return Settling(max(exponential, mser), not at_limit, constant)
