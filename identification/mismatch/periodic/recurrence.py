"""Whether a line comes again: in other runs, or in other parts of the only one.

A wave that is there as long as the mains or the rotor turn is in every run. One that stands out of one run alone may be
a ringing once struck, a hand on the stand, or a peak of noise that no law of noise foresaw.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.periodic.spectrum import Series, clipped
from identification.recording import Floats

QUARTERS = 4
"""Parts of the only run: the line must be in more than one of them."""
MOST_OFFSETS = 41
"""Frequencies beside a line's that are looked at in another run, in which the mains may be faster or slower."""


@dataclass(frozen=True, slots=True)
class Sighting:
    """What a line is in one run, or in a quarter of the only one."""

    run: int
    start: float
    end: float
    gain: float
    """In chi-square."""
    dof: int
    nearby_p: float = 1.0
    """p-value of the clearest frequency beside the line's own, of all that were tried."""

    @property
    def p_value(self) -> float:
        return min(float(chi2_sf(self.gain, self.dof)), self.nearby_p)


@dataclass(frozen=True, slots=True)
class Recurrence:
    """How surely a line comes again, and where it is clearest."""

    p_value: float
    """That the other parts hold noise alone."""
    clearest: Sighting
    others: int

    @property
    def again(self) -> bool:
        return self.p_value < policy.periodic.COMES_AGAIN_P


def recurrence(parts: Sequence[Sighting]) -> Recurrence:
    """All parts but the clearest together, or the clearest of these: the smaller p-value counts twice."""
    first = max(range(len(parts)), key=lambda i: parts[i].gain)
    rest = [part for i, part in enumerate(parts) if i != first]
    if not rest:
        return Recurrence(1.0, parts[first], 0)
    together = float(chi2_sf(sum(part.gain for part in rest), sum(part.dof for part in rest)))
    alone = len(rest) * min(part.p_value for part in rest)
    return Recurrence(min(2 * min(together, alone), 1.0), parts[first], len(rest))


def of_frequency(runs: Sequence[tuple[int, Series]], noise: Sequence[float], f: float) -> Recurrence:
    """Of a line at f Hz beside noise of these powers, one for each run (the square of the residual's unit)."""
    if len(runs) == 1:
        ((i, r),) = runs
        quarter = np.arange(r.time.size) * QUARTERS // r.time.size
        values = clipped(r.residual)
        cut = [(i, r.time[quarter == q], values[quarter == q]) for q in range(QUARTERS)]
        return recurrence([_at(*each, f, noise[0]) for each in cut])
    return recurrence([_near(i, r, f, s) for (i, r), s in zip(runs, noise, strict=True)])


def power(time: Floats, value: Floats, f: float) -> float:
    """|sum value exp(-2 pi i f t)|^2 / n."""
    angle = 2 * np.pi * f * time
    return float((value @ np.cos(angle)) ** 2 + (value @ np.sin(angle)) ** 2) / time.size


def _at(run: int, time: Floats, value: Floats, f: float, noise: float) -> Sighting:
    return Sighting(run, float(time[0]), float(time[-1]), 2 * power(time, value, f) / noise, 2)


def _near(run: int, series: Series, f: float, noise: float) -> Sighting:
    """At f, and round it as far as the mains wander."""
    values = clipped(series.residual)
    found = _at(run, series.time, values, f, noise)
    wander, step = policy.periodic.MAINS_WANDER * f, 0.5 / max(found.end - found.start, 1e-9)
    offsets = np.linspace(-wander, wander, int(np.clip(2 * wander / step + 1, 1, MOST_OFFSETS)))
    most = max(2 * power(series.time, values, f + d) / noise for d in offsets)
    nearby = min(offsets.size * float(chi2_sf(most, 2)), 1.0)
    return Sighting(run, found.start, found.end, found.gain, 2, nearby)


def of_stretches(
    span: Sequence[tuple[int, float, float]],
    piece: NDArray[np.intp],
    sums: NDArray[np.complex128],
    weights: Floats,
) -> Recurrence:
    """Of waves in stretches (k,): run, start and end of each, the piece whose phase it shares, its sum over the
    variance of the noise, and its samples over that. Parts are runs, or quarters of what the only run tells."""
    runs = np.array([run for run, _, _ in span])
    if np.unique(runs).size > 1:
        part = np.unique(runs, return_inverse=True)[1]
    else:
        before = np.cumsum(weights) - 0.5 * weights
        part = np.minimum((QUARTERS * before / weights.sum()).astype(np.intp), QUARTERS - 1)
    return recurrence([_of_part(span, piece, sums, weights, part == p) for p in np.unique(part)])


def _of_part(
    span: Sequence[tuple[int, float, float]],
    piece: NDArray[np.intp],
    sums: NDArray[np.complex128],
    weights: Floats,
    mine: NDArray[np.bool_],
) -> Sighting:
    gain = 0.0
    there = np.unique(piece[mine])
    for p in there:
        these = mine & (piece == p)
        gain += float(2 * np.abs(np.sum(sums[these])) ** 2 / np.sum(weights[these]))
    first, last = np.flatnonzero(mine)[[0, -1]]
    return Sighting(span[first][0], span[first][1], span[last][2], gain, 2 * there.size)
