"""Memory on intervals of uneven length: each in a few vectorised operations, stable at any length of interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs, ztbtrs

from identification.recording import Floats

LEAST_MOVE = 1e-12
"""Share of the largest value: means over intervals of a level differ by rounding."""
MOSTLY = 0.3
"""Of the intervals: where more reach beyond their neighbour, a delay is a long one."""


def recursion(keep: Floats, push: Floats, start: float) -> Floats:
    """y_k = keep_k y_{k-1} + push_k, y_{-1} = start; (M,), by one banded triangular solve."""
    push = push.copy()
    push[0] += keep[0] * start
    banded = np.empty((2, keep.size), order="F")  # as LAPACK wants it: not copied; the unit diagonal is not read
    np.negative(keep[1:], out=banded[1, :-1])
    solved, info = dtbtrs(banded, push[:, None], uplo="L", diag="U", overwrite_b=1)
    if info != 0:
        raise ValueError(f"recursion: banded solve failed with {info}")
    out: Floats = solved[:, 0]
    return out


def lowpass(u: Floats, dt: Floats, tau: Floats | float, start: float = 0.0) -> tuple[Floats, Floats]:
    """First-order low-pass y' = (u - y)/tau for u constant in each interval: exact y at the ends, and exact means.

    >>> end, mean = lowpass(np.array([1.0, 1.0]), np.array([1.0, 1.0]), 1.0)
    >>> end.round(4).tolist(), mean.round(4).tolist()
    ([0.6321, 0.8647], [0.3679, 0.7675])
    """
    share = dt / tau
    lost = -np.expm1(-share)
    end = recursion(1 - lost, lost * u, start)
    before = np.concatenate([[start], end[:-1]])
    mean = u + (before - u) * (lost / share)
    return end, mean


def integral(value: Floats, edges: Floats, at: Floats) -> Floats:
    """Integral of an interval-wise constant from the first edge to `at`; held constant outside."""
    total = np.concatenate([[0.0], np.cumsum(value * np.diff(edges))])
    out: Floats = np.interp(at, edges, total)
    early, late = at < edges[0], at > edges[-1]
    out[early] += (at[early] - edges[0]) * value[0]
    out[late] += (at[late] - edges[-1]) * value[-1]
    return out


@dataclass(frozen=True, eq=False, slots=True)
class ShortDelay:
    """Of M intervals what each looks back at, or ahead; held constant outside.

    Of most intervals it leaves a part, and takes one of the interval beside it: the delay is shorter than both.
    """

    back: bool
    """Whether at what was before."""
    share: Floats
    """(M-1,) of each that is its neighbour's, negative ahead: of all but the first, or but the last."""
    far: NDArray[np.intp]
    """(k,) intervals that reach beyond their neighbour."""
    begin: NDArray[np.intp]
    """(k,) of each of those its first among the parts."""
    part: NDArray[np.intp]
    """(e,) intervals that they look at."""
    weight: Floats
    """(e,) of each in the mean."""

    def of(self, value: Floats) -> Floats:
        """(M,) means of what is `value` (M,) in the intervals."""
        out = value.copy()
        moved = value[1:] - value[:-1]
        moved *= self.share
        if self.back:
            out[1:] -= moved
        else:
            out[:-1] -= moved
        if self.far.size:
            out[self.far] = np.add.reduceat(value[self.part] * self.weight, self.begin)
        return out


@dataclass(frozen=True, eq=False, slots=True)
class LongDelay:
    """The same of one that is longer than most intervals, by the integral over all before."""

    dt: Floats
    """(M,) s."""
    places: tuple[NDArray[np.intp], Floats]
    """Of the edges."""

    def of(self, value: Floats) -> Floats:
        return np.asarray(np.diff(integral_at(value, self.dt, self.places)) / self.dt, dtype=np.float64)


Delay = ShortDelay | LongDelay


def delay_of(edges: Floats, delay: float) -> Delay:
    """By `delay` s; below 0 it looks ahead. `edges` (M+1,) s.

    >>> delay_of(np.array([0.0, 1.0, 2.0, 4.0]), 0.5).of(np.array([0.0, 4.0, 8.0])).tolist()
    [0.0, 2.0, 7.0]
    """
    dt = edges[1:] - edges[:-1]
    size, back = abs(delay), delay > 0
    reaches = size > dt
    if back:
        reaches[1:] |= size > dt[:-1]
    else:
        reaches[:-1] |= size > dt[1:]
    far = np.flatnonzero(reaches)
    if far.size > MOSTLY * dt.size:
        return LongDelay(dt, places_of(edges, edges - delay))
    share = delay / (dt[1:] if back else dt[:-1])
    first, after_first = places_of(edges, edges[far] - delay)
    last, after_last = places_of(edges, edges[far + 1] - delay)
    many = last - first + 1
    begin = np.cumsum(many) - many
    part = np.arange(int(many.sum())) + np.repeat(first - begin, many)
    weight = dt[part]
    weight[begin] -= after_first
    weight[begin + many - 1] += after_last - dt[last]
    return ShortDelay(back, share, far, begin, part, weight / np.repeat(dt[far], many))


def delayed(value: Floats, edges: Floats, delay: float) -> Floats:
    """(M,) means over each interval of value(t - delay)."""
    return delay_of(edges, delay).of(value)


def places_of(edges: Floats, at: Floats) -> tuple[NDArray[np.intp], Floats]:
    """(k,) interval of each time, the first or last one beyond the ends, and s since it began."""
    index = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, edges.size - 2)
    return index, at - edges[index]


def integral_at(value: Floats, dt: Floats, places: tuple[NDArray[np.intp], Floats]) -> Floats:
    """As `integral`, at places that are known."""
    index, since = places
    total = np.zeros(value.size + 1)
    np.cumsum(value * dt, out=total[1:])
    before: Floats = total.take(index)
    before += since * value.take(index)
    return before


def reconstructed(mean: Floats, middle: Floats, at: Floats) -> Floats:
    """Value at a time within each interval, from means: a straight line, of the smaller slope to both neighbours.

    Where the slopes differ in sign (a step, an extremum) the mean itself (van Leer's limiter, minmod).
    """
    slope = (mean[1:] - mean[:-1]) / (middle[1:] - middle[:-1])
    left, right = slope[:-1], slope[1:]
    least = np.maximum(np.minimum(left, right), 0.0)
    least += np.minimum(np.maximum(left, right), 0.0)
    least *= (at - middle)[1:-1]
    out: Floats = mean.copy()
    out[1:-1] += least
    return out


def within_intervals(mean: Floats, edges: Floats, at: Floats) -> Floats:
    """(N,) values at any times, on the straight lines of `reconstructed`."""
    dt = np.diff(edges)
    middle = edges[:-1] + 0.5 * dt
    rise = (reconstructed(mean, middle, middle + 0.5 * dt) - mean) / (0.5 * dt)
    index = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, mean.size - 1)
    out: Floats = mean[index] + rise[index] * (at - middle[index])
    return out


def resonant(value: Floats, dt: Floats, frequency: float, damping: float) -> Floats:
    """Mass on a spring y'' + 2 damping w y' + w^2 y = w^2 value, w = 2 pi frequency: exact means over each interval.

    y is the imaginary part of (w^2/wd) z with z' = p z + value, p = -damping w + i wd: one complex first-order filter.
    """
    w = 2 * np.pi * frequency
    wd = w * np.sqrt(max(1 - damping**2, 1e-9))
    p = complex(-damping * w, wd)
    keep = np.exp(p * dt)
    end = complex_recursion(keep, value * (keep - 1) / p)
    before = np.concatenate([[0.0], end[:-1]])
    mean = ((end - before) / dt - value) / p
    out: Floats = (w**2 / wd) * mean.imag
    return out


def complex_recursion(keep: NDArray[np.complex128], push: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """y_k = keep_k y_{k-1} + push_k, y_{-1} = 0; (M,)."""
    banded = np.empty((2, keep.size), dtype=np.complex128, order="F")
    np.negative(keep[1:], out=banded[1, :-1])
    solved, info = ztbtrs(banded, push[:, None], uplo="L", diag="U")
    if info != 0:
        raise ValueError(f"recursion: banded solve failed with {info}")
    out: NDArray[np.complex128] = solved[:, 0]
    return out


def play(value: Floats, width: float) -> Floats:
    """Play operator y = min(max(y, value - width), value + width), from y = 0.

    While the value goes one way, y depends on where it was at the last turn only: one step of Python for each turn.
    """
    rise = np.diff(value)
    rise = np.where(np.abs(rise) > LEAST_MOVE * float(np.max(np.abs(value))), np.sign(rise), 0.0)
    moving = np.flatnonzero(rise)
    turns = moving[1:][rise[moving[1:]] != rise[moving[:-1]]]
    begins = np.concatenate([[0], turns])
    y, known = 0.0, []
    for v in value[begins].tolist():
        y = min(max(y, v - width), v + width)
        known.append(y)
    last = np.repeat(known, np.diff(np.append(begins, value.size - 1)))  # y at the last turn, from the second value on
    out: Floats = np.clip(np.concatenate([known[:1], last]), value - width, value + width)
    return out


def since_opposite(x: Floats, dt: Floats, turning: float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """S since it last turned the other way, s since it began to turn this way, and where either is known; (M,)."""
    sign = np.where(x > turning, 1, np.where(x < -turning, -1, 0))
    end = np.cumsum(dt)
    middle = end - 0.5 * dt
    index = np.arange(x.size)
    last = {s: np.maximum.accumulate(np.where(sign == s, index, -1)) for s in (1, -1)}
    now = np.where(last[1] > last[-1], 1, -1)  # the way it turns, or turned last
    other = np.where(now == 1, last[-1], last[1])
    known = (other >= 0) & (np.maximum(last[1], last[-1]) >= 0)
    ended = end[np.maximum(other, 0)]
    began = np.empty_like(middle)
    # first interval of this direction after `other`
    turns = np.flatnonzero((sign != 0) & known & (np.concatenate([[-2], other[:-1]]) != other))
    start = np.full(x.size, -1)
    start[turns] = turns
    start = np.maximum.accumulate(start)
    began = np.where(start >= 0, end[np.maximum(start, 0)] - dt[np.maximum(start, 0)], 0.0)
    return middle - ended, middle - began, known
