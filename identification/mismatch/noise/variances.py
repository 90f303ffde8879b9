"""The noise of a response from what a model leaves: all variances by restricted maximum likelihood.

So columns fitted to the same data do not make the noise look smaller than it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.noise.covariance import Noise, Rows, Shapes
from identification.mismatch.noise.restricted_likelihood import Likelihood, LinAlgError, Response, likelihood
from identification.recording import Floats

SCALE_STEP = 8.0
"""Ratio of neighbouring time scales."""
MOST_SCALES = 4
"""Time scales of slow noise: each is a state of every row, and costs time in proportion."""
LEAST_SHARE = 1e-12
"""Variances are kept above this share of the residual's."""
MOST_STEPS = 30
"""Steps of the search for variances, at most: it ends by ENDED."""
MOST_TRIES = 6
"""Dampings tried for one step of it."""
ENDED = 1e-3
"""Fall of half the restricted deviance at which the search for variances ends."""
NEARLY = 1e-2
"""Fall that is foretold so well that it is not looked at: the next would be ten times smaller, or a hundred."""


def longest_scale(runs: Sequence[Rows]) -> float:
    """s: LONGEST_NOISE_SCALE of the longest run. What is slower is a drift, and no noise."""
    return policy.estimate.LONGEST_NOISE_SCALE * max(float(r.time[-1] - r.time[0]) for r in runs)


def time_scales(runs: Sequence[Rows]) -> tuple[float, ...]:
    """From two samples to a quarter of the longest run, MOST_SCALES of them at even ratios."""
    longest = 4 * longest_scale(runs)
    spacing = float(np.median(np.concatenate([r.width / r.count for r in runs])))
    low, high = max(2 * spacing, 1e-3 * longest / MOST_SCALES), longest_scale(runs)
    if high <= 2 * low:
        return (high,) if high > 0 else ()
    number = min(MOST_SCALES, 1 + int(np.ceil(np.log(high / low) / np.log(SCALE_STEP))))
    return tuple(float(t) for t in np.geomspace(low, high, number))


def refined_scales(noise: Noise, rows: Sequence[Rows]) -> tuple[float, ...]:
    """Scales without variance give way to ones beside those with most."""
    spread = np.array(noise.slow)
    used = spread > 1e-3 * (spread.sum() + noise.white / float(np.median(rows[0].count)))
    free = int(np.count_nonzero(~used))
    if not used.any() or not free:
        return noise.scales
    T = np.array(noise.scales)
    step = np.sqrt(T[1] / T[0]) if T.size > 1 else 2.0
    kept = list(T[used])
    for t in sorted(kept, key=lambda t: -spread[list(T).index(t)]):
        for beside in (t / step, min(t * step, longest_scale(rows))):
            if free and all(abs(np.log(beside / k)) > 0.3 for k in kept):
                kept.append(float(beside))
                free -= 1
    return tuple(sorted(float(k) for k in kept))


def fit_noise(
    runs: Sequence[Rows],
    residuals: Sequence[Floats],
    columns: Sequence[Floats],
    sizes: Sequence[Floats],
    bands: tuple[tuple[float, float], ...] = (),
    start: Noise | None = None,
    *,
    in_time: bool = True,
    least: float = 0.0,
    shapes: Shapes | None = None,
) -> Noise:
    """Restricted maximum likelihood of all variances, common to all runs; without slow noise if rows are not in time.

    No white variance below `least`.

    `shapes`: what remembers the noise's matrices, where others ask for them too.

    `residuals` (n,) and `columns` (n, p) of what was fitted to them, `sizes` (n,) |F|, one of each per run.
    """
    total = np.concatenate(residuals)
    variance = float(np.mean(total**2)) or 1.0
    weight = np.concatenate([r.count for r in runs])
    if total.size < policy.estimate.COLOURED_NOISE_ROWS:
        X = np.concatenate(columns) * np.sqrt(weight)[:, None]
        y = total * np.sqrt(weight)
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0] if X.shape[1] else y
        return Noise(float(np.sum(left**2) / max(total.size - X.shape[1], 1)) or 1e-300, 0.0)
    F2 = float(np.mean(np.concatenate(sizes) ** 2)) or 1.0
    known = shapes or Shapes()
    responses = [Response(*each, known) for each in zip(runs, residuals, columns, sizes, strict=True)]

    def likeliest(begin: Noise) -> Noise:
        more = [variance] * (len(begin.scales) + len(begin.bands))
        floor = LEAST_SHARE * np.array([variance, variance / F2, *more])
        begun = begin.with_variances(np.maximum(begin.variances, 1e3 * floor))
        floor[0] = max(floor[0], least)
        return _likeliest(begun, responses, floor)

    if start is None or start.bands != bands:
        scales = time_scales(runs) if in_time else ()
        quick = _differences(runs, residuals)
        slower = max(_beside(total, np.concatenate(columns)) - quick * float(np.mean(1 / weight)), 0.05 * variance)
        slow = tuple([slower / max(len(scales), 1)] * len(scales))
        start = Noise(quick, 0.02 * quick / F2, scales, slow, bands, tuple([0.05 * variance] * len(bands)))
        first = likeliest(start)
        scales = refined_scales(first, runs)
        if scales == first.scales:
            return first
        slow = tuple(first.slow[first.scales.index(t)] if t in first.scales else 0.02 * sum(first.slow) for t in scales)
        start = replace(first, scales=scales, slow=slow)
    return likeliest(start)


def _likeliest(start: Noise, responses: Sequence[Response], floor: Floats) -> Noise:
    """The variances of greatest restricted likelihood above `floor`, scales and bands as in `start`.

    Newton's method with the average information, damped; the common factor of all variances in closed form.
    """
    values, here = _levelled(start, np.maximum(start.variances, floor), responses, floor)
    damping = 1e-3
    for _ in range(MOST_STEPS):
        step = _step(values, here, floor, damping)
        foretold = -float(here.slope @ step)
        if foretold < NEARLY:
            return start.with_variances(values + step if foretold > 0 else values)
        for _ in range(MOST_TRIES):
            try:
                moved, there = _levelled(start, values + step, responses, floor)
            except LinAlgError:
                there = None
            if there is not None and there.value < here.value:
                break
            damping *= 10
            step = _step(values, here, floor, damping)
        else:
            break
        assert there is not None
        fall = here.value - there.value
        values, here = moved, there
        damping = max(damping / 10, 1e-6)
        if fall < ENDED:
            break
    return start.with_variances(values)


def _levelled(noise: Noise, values: Floats, responses: Sequence[Response], floor: Floats) -> tuple[Floats, Likelihood]:
    """Variances times the common factor that suits them best, and the likelihood there."""
    here = likelihood(noise.with_variances(values), responses)
    s = here.quadratic / max(here.freedom, 1)
    if not s > 0 or bool(np.any(values * s < floor)):
        return values, here
    return values * s, here.scaled(s)


def _step(values: Floats, here: Likelihood, floor: Floats, damping: float) -> Floats:
    """(k,) damped Newton step that ends at or above `floor`."""
    step = np.zeros(values.size)
    size = np.sqrt(np.diag(here.information))
    free = (size > 0) & ((values > 1.001 * floor) | (here.slope < 0))
    size = np.where(size > 0, size, 1.0)
    A, g = here.information / np.outer(size, size), here.slope / size
    A = A + damping * np.eye(values.size)
    while free.any():
        fixed = A[:, ~free] @ (step * size)[~free]
        step[free] = -np.linalg.solve(A[np.ix_(free, free)], (g + fixed)[free]) / size[free]
        low = free & (values + step < floor)
        if not low.any():
            break
        step[low] = floor[low] - values[low]
        free &= ~low
    return step


def _beside(residual: Floats, columns: Floats) -> float:
    """Variance of a residual (n,) beside columns (n, p) that were fitted to it."""
    left = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0] if columns.shape[1] else residual
    return float(np.mean(left**2))


def _differences(runs: Sequence[Rows], residuals: Sequence[Floats]) -> float:
    """Variance of one sample from differences of neighbouring rows, robust against steps."""
    found = []
    for rows, r in zip(runs, residuals, strict=True):
        scale = np.sqrt(1 / rows.count[1:] + 1 / rows.count[:-1])
        found.append(np.abs(np.diff(r)) / scale)
    out = float(np.median(np.concatenate(found)) / 0.6745) ** 2
    return out if out > 0 else 1e-6 * float(np.mean(np.concatenate(residuals) ** 2)) or 1e-300
