"""What rounding does to the mean of a reading that stands still: at all of a level alike, so that no number of samples
averages it away, and it looks like a bend of the static curve.

A reading x with noise of standard deviation s, rounded to whole steps q, has the mean x + b(x) with
b(x) = q/pi sum_k (-1)^k/k exp(-2 pi^2 k^2 s^2/q^2) sin(2 pi k x/q) (Widrow and Kollar, Quantization Noise, 2008).
Where between two steps a level lies nobody knows before all physics is known, so b is an error of the level, of
variance B(s) = (q/pi)^2/2 sum_k exp(-4 pi^2 k^2 s^2/q^2)/k^2: q^2/12 without noise, nothing from s = q/2 on.
Over a few steps b goes on in its waves; where the reading passes over steps within an interval b averages out.
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
"""Steps within which readings have much the same b."""
STANDING = 0.1
"""Steps over which a reading goes from sample to sample at most, where what scatters is asked for."""
WAVES, LEAST_WAVE = 3, 0.1
"""Of b over a step that are told to the noise, and what a higher one has of the first at least."""
BLOCKS = (1, 2, 4, 8)
"""Steps over which b goes on in phase: as few as ROUNDED_LEVELS columns allow. The first model is off by that much."""
MOVING = np.iinfo(np.intp).max
"""Place of a reading that stands nowhere."""
SETTLED_SAMPLES = 2
"""Of the second half of a stretch, at least, where its scatter is asked for."""


def level_variance(scatter: float, quantum: float) -> float:
    """B in N^2 from the mean variance of samples about their level, which is s^2 + q^2/12 - B(s).

    Where levels lie anywhere between two steps, x + e - Q(x + e) is even over a step whatever the noise e is, and
    independent of it: their variances add. B of the sum is common to a level, the rest is what scatters in it.

    >>> round(level_variance(0.0, 1.0), 4), round(level_variance(0.2, 1.0), 4), level_variance(1.0, 1.0)
    (0.0833, 0.0005, 0.0)
    """
    noise, common = _law()
    return quantum**2 * float(np.interp(scatter / quantum**2, noise**2 + 1 / 12 - common, common, right=0.0))


def _noise_variance(scatter: float, quantum: float) -> float:
    """s^2 in N^2 from the same; what is more than DITHERED is told as that."""
    noise, common = _law()
    return quantum**2 * float(np.interp(scatter / quantum**2, noise**2 + 1 / 12 - common, noise**2))


def _law() -> tuple[Floats, Floats]:
    """(n,) s and B(s) of steps of 1."""
    noise = np.linspace(0.0, DITHERED, 501)
    k = np.arange(1, HARMONICS + 1)
    common = np.sum(np.exp(-4 * (np.pi * np.outer(noise, k)) ** 2) / k**2, axis=1)
    return noise, common / (12 * common[0])


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
    deviation of a wave of b over the reading; none where noise hides it.

    Where the steps lie is known within a few of them (`_block`), and forgotten beyond.
    """
    if not h.quantum > 0 or h.static:
        return np.empty((h.driver.size, 0))
    steps = C * (h.driver * np.abs(h.driver) + h.excess) / h.quantum
    passed = np.abs(_signed(steps))
    scatter = _scatter(h, steps, passed)
    if scatter is None:
        return np.empty((h.driver.size, 0))
    waves = _waves(scatter, h.quantum)
    seen = _seen(h, steps, passed, level_variance(scatter, h.quantum), scatter)
    if not waves.size or not seen.any():
        return np.empty((h.driver.size, 0))
    most = policy.estimate.ROUNDED_LEVELS // (2 * waves.size)
    block = next(n for n in BLOCKS if np.unique(np.floor(steps[seen] / n)).size <= most or n == BLOCKS[-1])
    _, which = np.unique(np.floor(steps / block), return_inverse=True)
    k = np.arange(1, waves.size + 1)
    left = waves * np.sinc(k * passed[:, None]) * np.where(seen, 1.0, 0.0)[:, None]
    angle = 2 * np.pi * k * steps[:, None]
    own = np.hstack((left * np.cos(angle), left * np.sin(angle)))
    weight = np.bincount(which, weights=h.count * np.sum(own**2, axis=1))
    chosen = np.argsort(-weight, kind="stable")[: min(int(np.count_nonzero(weight)), most)]
    out = np.concatenate([np.where((which == at)[:, None], own, 0.0) for at in chosen.tolist()], axis=1)
    return np.asarray(out, dtype=np.float64)


def _waves(scatter: float, quantum: float) -> Floats:
    """(k,) N, standard deviations of cosine and sine of the first waves of b; none that is plainly less than the first.

    >>> _waves(1.0, 1.0).size, [round(float(w), 3) for w in _waves(0.055, 1.0)]
    (0, [0.186, 0.053])
    """
    s = np.sqrt(_noise_variance(scatter, quantum)) / quantum
    if s >= DITHERED:
        return np.empty(0)
    k = np.arange(1, WAVES + 1)
    out = quantum / (np.pi * k * np.sqrt(2)) * np.exp(-2 * (np.pi * k * s) ** 2)
    return np.asarray(out[out > LEAST_WAVE * out[0]], dtype=np.float64)


def _seen(h: History, steps: Floats, passed: Floats, variance: float, scatter: float) -> NDArray[np.bool_]:
    """(M,) of readings that noise and number leave something of b to be seen in."""
    _, place = np.unique(np.floor(steps / ALIKE + 0.5), return_inverse=True)
    left = np.where(passed < 1, np.sinc(np.minimum(passed, 1.0)), 0.0)
    weight = np.bincount(place, weights=h.count * left**2)
    out: NDArray[np.bool_] = (weight * variance > policy.estimate.ROUNDING_UNSEEN * scatter)[place] & (passed < 1)
    return out


def _signed(steps: Floats) -> Floats:
    """(M,) steps by which the reading goes on in each interval; none beside a jump."""
    beyond = np.diff(steps)
    after, before = np.append(beyond, np.inf), np.append(np.inf, beyond)
    return np.asarray(np.where(np.abs(after) < np.abs(before), after, before), dtype=np.float64)


def _scatter(h: History, steps: Floats, passed: Floats) -> float | None:
    """N^2, half the mean square of the differences of neighbouring samples, less those of the model, in the second half
    of stretches of alike readings; a place counts once however often it is met, and as no more than one in which noise
    leaves nothing of b. None where nothing stands still."""
    places = np.where(passed < STANDING, np.floor(steps / ALIKE + 0.5).astype(np.intp), MOVING)
    starts = np.flatnonzero(np.diff(places, prepend=places[0] - 1))
    begun, ended = h.edges[starts], h.edges[np.append(starts[1:], places.size)]
    first, last = np.searchsorted(h.sample_time, 0.5 * (begun + ended)), np.searchsorted(h.sample_time, ended)
    many = (last - first >= SETTLED_SAMPLES) & (places[starts] < MOVING)
    if not many.any():
        return None
    at = np.clip(np.searchsorted(h.edges, h.sample_time, side="right") - 1, 0, steps.size - 1)
    moved = (_signed(steps) / h.dt)[at] * (h.sample_time - h.middle[at])
    left = h.sample_thrust - h.quantum * (steps[at] + moved)
    summed = np.concatenate(([0.0], np.cumsum(0.5 * np.diff(left) ** 2)))
    pairs = (last - first)[many] - 1.0
    _, place = np.unique(places[starts][many], return_inverse=True)
    total = np.bincount(place, weights=summed[last[many] - 1] - summed[first[many]])
    of_place = total / np.bincount(place, weights=pairs)
    return float(np.mean(np.minimum(of_place, (DITHERED**2 + 1 / 12) * h.quantum**2)))
