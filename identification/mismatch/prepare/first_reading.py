"""What a channel began with that bends slowly: C refers to it, and a first sample has all of the noise."""

from __future__ import annotations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.prepare.measured_driver import noise_of
from identification.recording import Channel, Floats

FEWEST = 8
"""Samples of the shortest window; each next one has twice as many."""
MOST_MISFIT = 2.0
"""sigma of chi-square by which a parabola may miss the samples of a window that it is believed over."""


def first_reading(channel: Channel | None) -> tuple[float, float]:
    """The value at the first finite sample and its standard error, in the channel's unit; (0, 0) without any.

    Parabolas are laid through the samples of longer and longer windows from there on, while they fit and agree with the
    shorter ones; what is told is of half the longest, as the longest just begins to bend otherwise (Lepski, Theory
    Probab. Appl. 35, 1990, 454; undersmoothing: Hall, Ann. Stat. 20, 1992, 675).
    """
    if channel is None or not np.isfinite(channel.value).any():
        return 0.0, 0.0
    good = np.isfinite(channel.value)
    time, value = channel.time[good], channel.value[good]
    noise, step = noise_of(value), (channel.acquisition.quantum or 0.0) / float(np.sqrt(12.0))
    found = _believed(time, value, noise) if noise > 0 else []
    first, error = found[max(len(found) - 2, 0)] if found else (float(value[0]), noise)
    return first, float(np.hypot(error, step))


def _believed(time: Floats, value: Floats, noise: float) -> list[tuple[float, float]]:
    """Of each window that is believed, the shortest first."""
    out: list[tuple[float, float]] = []
    low, high, many = -np.inf, np.inf, FEWEST
    while many <= value.size:
        late = (time[:many] - time[0]) / (time[many - 1] - time[0])
        columns = np.column_stack([np.ones(many), late, late**2])
        theta = np.linalg.lstsq(columns, value[:many], rcond=None)[0]
        error = noise * float(np.sqrt(np.linalg.inv(columns.T @ columns)[0, 0]))
        free = many - columns.shape[1]
        missed = float(np.sum((value[:many] - columns @ theta) ** 2)) / noise**2
        reach = policy.prepare.SMOOTHING_AGREES_SIGMA * error
        low, high = max(low, theta[0] - reach), min(high, theta[0] + reach)
        if low > high or missed > free + MOST_MISFIT * float(np.sqrt(2.0 * free)):
            break
        out.append((float(theta[0]), error))
        many *= 2
    return out
