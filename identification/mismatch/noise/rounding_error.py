"""What rounding does to the mean of a reading that stands still: at all of a level alike, so that no number of samples
averages it away, and it looks like a bend of the static curve.

A reading x with noise of standard deviation s, rounded to whole steps q, has the mean x + b(x) with
b(x) = q/pi sum_k (-1)^k/k exp(-2 pi^2 k^2 s^2/q^2) sin(2 pi k x/q) (Widrow and Kollar, Quantization Noise, 2008).
Where between two steps a level lies nobody knows before all physics is known, so b is an error of the level, of
variance B(s) = (q/pi)^2/2 sum_k exp(-4 pi^2 k^2 s^2/q^2)/k^2: q^2/12 without noise, nothing from s = q/2 on.
Readings much nearer than a step have the same b; where the reading passes over steps within an interval b averages out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.recording import Floats
from identification.run_history.history import History

HARMONICS = 60
"""Of the sum over k: the rest is below 1 % of q^2/12, where there is no noise at all."""
DITHERED = 0.5
"""Steps: noise of this standard deviation leaves b below 0.3 % of a step, and the scatter tells no more of it."""
ALIKE = 1 / 3
"""Steps within which readings have the same b."""
MOVING = np.iinfo(np.intp).max
"""Place of a reading that stands nowhere."""
SETTLED_SAMPLES = 4
"""Of the second half of a stretch, at least, where its scatter is asked for."""


def level_variance(scatter: float, quantum: float) -> float:
    """B in N^2 from the mean variance of samples about their level, which is s^2 + q^2/12 - B(s).

    Where levels lie anywhere between two steps, x + e - Q(x + e) is even over a step whatever the noise e is, and
    independent of it: their variances add. B of the sum is common to a level, the rest is what scatters in it.

    >>> round(level_variance(0.0, 1.0), 4), round(level_variance(0.2, 1.0), 4), level_variance(1.0, 1.0)
    (0.0833, 0.0093, 0.0)
    """
    noise = np.linspace(0.0, DITHERED, 501)
    k = np.arange(1, HARMONICS + 1)
    common = np.sum(np.exp(-4 * (np.pi * np.outer(noise, k)) ** 2) / k**2, axis=1)
    common /= 12 * common[0]
    return quantum**2 * float(np.interp(scatter / quantum**2, noise**2 + 1 / 12 - common, common, right=0.0))


def rounding_wave(scatter: float, quantum: float) -> float:
    """N, the largest wave that rounding makes of readings that pass over steps evenly: of b, k = 1. `scatter`: N^2,
    variance of samples about what moves, s^2 + q^2/12 there.

    >>> [round(rounding_wave(s**2 + 1 / 12, 1.0), 3) for s in (0.0, 0.1, 1.0)]
    [0.318, 0.261, 0.0]
    """
    if not quantum > 0:
        return 0.0
    s = max(scatter / quantum**2 - 1 / 12, 0.0)
    return float(quantum / np.pi * np.exp(-2 * np.pi**2 * s))


def rounding_errors(h: History, C: float) -> Floats:
    """(M, k) N: what readings of the thrust C V|V| may be off by as they were rounded, each column one standard
    deviation and common to readings that are alike; none where noise hides it."""
    if not h.quantum > 0 or h.static:
        return np.empty((h.driver.size, 0))
    steps = C * (h.driver * np.abs(h.driver) + h.excess) / h.quantum
    places = np.floor(steps / ALIKE + 0.5).astype(np.intp)
    passed = _passed(steps)
    scatter = _scatter(h, np.where(passed < ALIKE, places, MOVING))
    if scatter is None:
        return np.empty((h.driver.size, 0))
    variance = level_variance(scatter, h.quantum)
    left = np.where(passed < 1, np.sinc(np.minimum(passed, 1.0)), 0.0)
    _, which = np.unique(places, return_inverse=True)
    weight = np.bincount(which, weights=h.count * left**2)
    told = weight * variance > policy.estimate.ROUNDING_UNSEEN * scatter
    chosen = np.argsort(-weight * told, kind="stable")[: min(int(told.sum()), policy.estimate.ROUNDED_LEVELS)]
    out = np.where(which[:, None] == chosen, left[:, None], 0.0) * np.sqrt(variance)
    return np.asarray(out, dtype=np.float64)


def _passed(steps: Floats) -> Floats:
    """(M,) steps over which the reading goes in each interval; none beside a jump."""
    beyond = np.abs(np.diff(steps))
    out: Floats = np.minimum(np.append(beyond, np.inf), np.append(np.inf, beyond))
    return out


def _scatter(h: History, places: NDArray[np.intp]) -> float | None:
    """N^2, mean variance of a sample about the mean of the second half of a stretch of alike readings; a place counts
    once however often it is met, and as no more than one in which noise leaves nothing of b. None where nothing stands
    still."""
    starts = np.flatnonzero(np.diff(places, prepend=places[0] - 1))
    begun, ended = h.edges[starts], h.edges[np.append(starts[1:], places.size)]
    first, last = np.searchsorted(h.sample_time, 0.5 * (begun + ended)), np.searchsorted(h.sample_time, ended)
    many = (last - first >= SETTLED_SAMPLES) & (places[starts] < MOVING)
    if not many.any():
        return None
    found = [float(np.var(h.sample_thrust[i:j], ddof=1)) for i, j in zip(first[many], last[many], strict=True)]
    _, place = np.unique(places[starts][many], return_inverse=True)
    weight = (last - first)[many].astype(np.float64)
    of_place = np.bincount(place, weights=weight * found) / np.bincount(place, weights=weight)
    return float(np.mean(np.minimum(of_place, (DITHERED**2 + 1 / 12) * h.quantum**2)))
