"""The noise of a measured driver averaged, and nothing else: noise in what explains would be taken for physics.

A lag or a ringing stand averages too: beside a driver with its noise it would explain the thrust better than none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.recording import Floats

REACHES = (2, 4, 8, 16, 32, 64, 128, 256)
"""Samples on either side that are averaged."""
TWICE = 1.8
"""Variance of a straight line fitted twice, by that of one fitted once."""
LATER = (1.0, 0.75, 0.5, 0.25)
"""Parts of what lies between two jumps that may stand still: a rotor takes its time."""


@dataclass(frozen=True, slots=True)
class Level:
    """A level that stood still: index of its first sample and one past its last, their times in s, their mean and its
    standard error."""

    first: int
    last: int
    begun: float
    ended: float
    value: float
    error: float


@dataclass(frozen=True, eq=False, slots=True)
class Smoothed:
    """A driver without most of its noise."""

    value: Floats
    error: Floats
    """(n,) standard error beside that of a level."""
    levels: tuple[Level, ...]


def smoothed(time: Floats, value: Floats, jumps: NDArray[np.bool_], noise: float) -> Smoothed:
    """(n,) the driver without most of its white noise (standard deviation `noise`), no jump (n-1,) rounded off.

    A level that stands still is its mean. Elsewhere each sample is taken from a straight line through its neighbours,
    fitted once more to what that leaves, so that curves are followed; as many neighbours as agree with fewer.
    """
    first = np.concatenate([[0], np.flatnonzero(jumps | _bent(value, jumps, noise)) + 1])
    size = np.diff(np.append(first, value.size))
    level = np.repeat(np.arange(first.size), size)
    index = np.arange(value.size)
    begin, end = first[level], (first + size)[level]
    out, least = value.copy(), np.ones(value.size)
    low, high = (
        value - policy.prepare.SMOOTHING_AGREES_SIGMA * noise,
        value + policy.prepare.SMOOTHING_AGREES_SIGMA * noise,
    )
    agree = np.ones(value.size, dtype=bool)
    shorter, its_share = value, least
    for reach in REACHES:
        window = np.maximum(index - reach, begin), np.minimum(index + reach + 1, end)
        agree &= _no_kink(time, value, *window, noise)
        line, share = _line(time, value, *window)
        line, share = line + _line(time, value - line, *window)[0], np.minimum(TWICE * share, 1.0)
        error = policy.prepare.SMOOTHING_AGREES_SIGMA * noise * np.sqrt(share)
        low, high = np.maximum(low, line - error), np.minimum(high, line + error)
        agree &= low <= high
        better = agree & (its_share < least)
        out[better], least[better] = shorter[better], its_share[better]
        shorter, its_share = line, share
    least[least > policy.prepare.KINKED_VARIANCE * float(np.median(least))] = 1.0
    levels = [found for i, n in zip(first, size, strict=True) if (found := _still(time, value, i, i + n, noise))]
    for one in levels:
        least[first[level[one.first]] : one.first] = 1.0  # on its way there
        out[one.first : one.last], least[one.first : one.last] = one.value, 0.0
    return Smoothed(out, noise * np.sqrt(least), tuple(levels))


def _bent(value: Floats, jumps: NDArray[np.bool_], noise: float) -> NDArray[np.bool_]:
    """(n-1,) beside samples at which it bends by far more than noise: no line goes through these."""
    bent = (np.abs(np.diff(value, 2)) > policy.prepare.BENT_SIGMA * np.sqrt(6.0) * noise) & ~(jumps[1:] | jumps[:-1])
    out = np.zeros(value.size - 1, dtype=bool)
    out[:-1] |= bent
    out[1:] |= bent
    return out


def _line(time: Floats, value: Floats, begin: NDArray[np.intp], end: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """(n,) straight lines through the samples begin..end round each sample, there; and their variance by that of a
    sample. Windows of fewer than three leave the sample."""
    t, v = (time - time.mean()).astype(np.longdouble), value.astype(np.longdouble)  # sums of squares, then differences
    n = end - begin
    at, mean, squares, products = (_sums(q, begin, end) for q in (t, v, t * t, t * v))
    at, mean = at / n, mean / n
    enough = n > 2
    spread = np.where(enough, squares - n * at**2, 1.0)
    line = np.where(enough, mean + (products - n * at * mean) / spread * (t - at), v)
    share = np.where(enough, 1 / n + (t - at) ** 2 / spread, 1.0)
    return line.astype(np.float64), share.astype(np.float64)


def _sums(value: NDArray[np.longdouble], begin: NDArray[np.intp], end: NDArray[np.intp]) -> NDArray[np.longdouble]:
    total = np.concatenate([np.zeros(1, dtype=np.longdouble), np.cumsum(value)])
    out: NDArray[np.longdouble] = total[end] - total[begin]
    return out


def _no_kink(
    time: Floats, value: Floats, begin: NDArray[np.intp], end: NDArray[np.intp], noise: float
) -> NDArray[np.bool_]:
    """(n,) whether the lines through the samples before and after each one meet there; a curve bends both alike."""
    index = np.arange(value.size)
    left, its = _line(time, value, begin, index + 1)
    right, other = _line(time, value, index, end)
    out: NDArray[np.bool_] = np.abs(left - right) <= policy.prepare.KINK_SIGMA * noise * np.sqrt(its + other)
    return out


def _still(time: Floats, value: Floats, first: int, last: int, noise: float) -> Level | None:
    """The samples first..last, or the later part of them, where white noise alone moves them."""
    for share in LATER:
        begin = last - int(share * (last - first))
        if _stands(time[begin:last], value[begin:last], noise):
            begin = begin if share == 1.0 else (begin + last) // 2  # the end of its way is lost in noise
            n, mean = last - begin, float(value[begin:last].mean())
            return Level(begin, last, float(time[begin]), float(time[last - 1]), mean, noise / float(np.sqrt(n)))
    return None


def _stands(time: Floats, value: Floats, noise: float) -> bool:
    """Whether there is no more than white noise in these samples."""
    n = value.size
    if n < policy.prepare.STILL_SAMPLES:
        return False
    off, late = value - value.mean(), time - time.mean()
    slope, along = float(off @ late) / float(np.sqrt(late @ late)), float(off[1:] @ off[:-1]) / float(np.sqrt(n))
    narrow = float(off @ off) / (n - 1) < noise**2 * (1 + policy.prepare.STILL_VARIANCE_SIGMA * float(np.sqrt(2 / n)))
    return narrow and abs(slope) < policy.prepare.STILL_SIGMA * noise and along < policy.prepare.STILL_SIGMA * noise**2
