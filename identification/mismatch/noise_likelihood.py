"""The noise of a response from what a model leaves: all variances by restricted maximum likelihood.

Variances enter the covariance linearly; they are found with the exact gradient (Patterson and Thompson, Biometrika
1971), so that columns fitted to the same data do not make the noise look smaller than it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from celerite2 import backprop, driver
from scipy.optimize import minimize

from identification.mismatch.noise import Noise, Rows
from identification.recording import Floats

SCALE_STEP = 8.0
"""Ratio of neighbouring time scales."""
MOST_SCALES = 4
"""celerite2 0.3.3 gives wrong slopes for more than four columns (its tests stop there)."""
FEW_ROWS = 100
"""With fewer rows the noise is taken as white."""
LEAST_SHARE = 1e-12
"""Variances are kept above this share of the residual's."""


def time_scales(runs: Sequence[Rows]) -> tuple[float, ...]:
    """From two samples to a quarter of the longest run, MOST_SCALES of them at even ratios."""
    longest = max(float(r.time[-1] - r.time[0]) for r in runs)
    spacing = float(np.median(np.concatenate([r.width / r.count for r in runs])))
    low, high = max(2 * spacing, 1e-3 * longest / MOST_SCALES), 0.25 * longest
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
        for beside in (t / step, t * step):
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
) -> Noise:
    """Restricted maximum likelihood of all variances, common to all runs.

    `residuals` (n,) and `columns` (n, p) of what was fitted to them, `sizes` (n,) |F|, one of each per run.
    """
    total = np.concatenate(residuals)
    variance = float(np.mean(total**2)) or 1.0
    weight = np.concatenate([r.count for r in runs])
    if total.size < FEW_ROWS:
        X = np.concatenate(columns) * np.sqrt(weight)[:, None]
        y = total * np.sqrt(weight)
        left = y - X @ np.linalg.lstsq(X, y, rcond=None)[0] if X.shape[1] else y
        return Noise(float(np.sum(left**2) / max(total.size - X.shape[1], 1)) or 1e-300, 0.0)
    F2 = float(np.mean(np.concatenate(sizes) ** 2)) or 1.0
    if start is None or start.bands != bands:
        scales = time_scales(runs)[: MOST_SCALES - 2 * len(bands)]
        quick = _differences(runs, residuals)
        slow = tuple([0.05 * variance / max(len(scales), 1)] * len(scales))
        start = Noise(quick, 0.02 * quick / F2, scales, slow, bands, tuple([0.05 * variance] * len(bands)))
        first = _likeliest(start, runs, residuals, columns, sizes, variance, F2)
        scales = refined_scales(first, runs)
        if scales == first.scales:
            return first
        slow = tuple(first.slow[first.scales.index(t)] if t in first.scales else 0.02 * sum(first.slow) for t in scales)
        start = replace(first, scales=scales, slow=slow)
    return _likeliest(start, runs, residuals, columns, sizes, variance, F2)


def _likeliest(
    start: Noise,
    runs: Sequence[Rows],
    residuals: Sequence[Floats],
    columns: Sequence[Floats],
    sizes: Sequence[Floats],
    variance: float,
    F2: float,
) -> Noise:
    """The variances of greatest restricted likelihood, scales and bands as in `start`."""
    floor = LEAST_SHARE * np.array([variance, variance / F2] + [variance] * (len(start.scales) + len(start.bands)))
    begin = np.log(np.maximum(start.variances, 1e3 * floor))

    def cost(log_values: Floats) -> tuple[float, Floats]:
        values = np.exp(log_values)
        try:
            value, slope = _cost(start.with_variances(values), runs, residuals, columns, sizes)
        except driver.LinAlgError:
            return 1e30, np.zeros_like(log_values)
        return value, slope * values

    bounds = [(np.log(low), np.log(1e3 * low / LEAST_SHARE)) for low in floor]
    found = minimize(cost, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 40, "ftol": 1e-7})
    return start.with_variances(np.exp(found.x))


def _differences(runs: Sequence[Rows], residuals: Sequence[Floats]) -> float:
    """Variance of one sample from differences of neighbouring rows, robust against steps."""
    found = []
    for rows, r in zip(runs, residuals, strict=True):
        scale = np.sqrt(1 / rows.count[1:] + 1 / rows.count[:-1])
        found.append(np.abs(np.diff(r)) / scale)
    out = float(np.median(np.concatenate(found)) / 0.6745) ** 2
    return out if out > 0 else 1e-6 * float(np.mean(np.concatenate(residuals) ** 2)) or 1e-300


def _cost(
    noise: Noise, runs: Sequence[Rows], residuals: Sequence[Floats], columns: Sequence[Floats], sizes: Sequence[Floats]
) -> tuple[float, Floats]:
    """Half the restricted deviance, and its slope over each variance."""
    factored = []
    p = columns[0].shape[1]
    gram, moment = np.zeros((p, p)), np.zeros(p)
    for rows, r, X, size in zip(runs, residuals, columns, sizes, strict=True):
        c, a, U, V = noise.correlated(rows, size)
        n, J = U.shape
        d, W, S = backprop.factor_fwd(rows.time, c, a, U, V, np.empty(n), np.empty((n, J)), np.empty((n, J, J)))
        Y = np.ascontiguousarray(np.column_stack([X, r]))
        Z = driver.solve_lower(rows.time, c, U, W, Y, np.empty_like(Y))
        weighted = Z[:, :p] / d[:, None]
        gram += Z[:, :p].T @ weighted
        moment += weighted.T @ Z[:, p]
        factored.append((c, a, U, V, d, W, S))
    value, slope = 0.0, np.zeros(2 + len(noise.slow) + len(noise.band))
    if p:
        lower = np.linalg.cholesky(gram + 1e-12 * np.diag(np.diag(gram) + 1e-300))
        over = np.linalg.inv(lower)
        beta = over.T @ (over @ moment)
        value += float(np.sum(np.log(np.diag(lower))))
    for (c, a, U, V, d, W, S), rows, r, X, size in zip(factored, runs, residuals, columns, sizes, strict=True):
        left = r - X @ beta if p else r
        Y = np.ascontiguousarray(np.column_stack([left, X @ over.T]) if p else left[:, None])
        Z, ba, bU = _backwards(rows.time, c, a, U, V, d, W, S, Y)
        value += 0.5 * float(np.sum(np.log(d))) + 0.5 * float(np.sum(Z[:, 0] ** 2 / d))
        slope += _over_variances(noise, rows, size, ba, bU)
    return value, slope


def _backwards(
    time: Floats, c: Floats, a: Floats, U: Floats, V: Floats, d: Floats, W: Floats, S: Floats, Y: Floats
) -> tuple[Floats, Floats, Floats]:
    """(Z, slope over a, slope over U) of half of log det K + sum of y' K^-1 y over the columns y of Y."""
    n, J = U.shape
    k = Y.shape[1]

    def none(*shape: int) -> Floats:
        return np.zeros(shape)  # celerite2 adds to what it is given

    Z, F = backprop.solve_lower_fwd(time, c, U, W, Y, np.empty_like(Y), np.empty((n, J, k)))
    bZ = np.ascontiguousarray(Z / d[:, None])
    solved = backprop.solve_lower_rev(time, c, U, W, Y, Z, F, bZ, none(n), none(J), none(n, J), none(n, J), none(n, k))
    bd = 0.5 / d - 0.5 * np.sum(Z**2, axis=1) / d**2
    bW = np.ascontiguousarray(solved[3])
    factored = backprop.factor_rev(time, c, a, U, V, d, W, S, bd, bW, none(n), none(J), none(n), none(n, J), none(n, J))
    return Z, factored[2], solved[2] + factored[3]


def _over_variances(noise: Noise, rows: Rows, size: Floats, ba: Floats, bU: Floats) -> Floats:
    """Slope over each variance of the noise, from those over celerite's a and U."""
    shape = noise.shape(rows)
    per_count = rows.extra / rows.count
    slope = [float(ba @ per_count), float(ba @ (per_count * size**2))]
    moved = np.sum(bU * shape.U, axis=0)  # U is linear in the variances
    J = len(noise.slow)
    by_band = moved[J:].reshape(-1, 2).sum(axis=1)
    slope.extend(ba @ shape.gain2 + np.concatenate([moved[:J], by_band]))
    return np.array(slope)
