"""Noise of a response: white, proportional to the force, slow on many time scales, and in bands; and its whitening.

The covariance of rows at uneven times is K = diag((white^2 + (proportional |F|)^2)/count) + sum_j v_j exp(-|dt|/T_j)
+ sum_b v_b cos-like kernels of damped oscillators: a celerite matrix (Foreman-Mackey, Agol, Ambikasaran and Angus,
AJ 154, 220, 2017), which is factored in time proportional to the number of rows. Exponentials on time scales a factor 8
apart make any noise between white and 1/f^2. All variances enter linearly; they are found by restricted maximum
likelihood (Patterson and Thompson, Biometrika 1971) with the exact gradient, so that columns fitted to the same data do
not make the noise look smaller than it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from celerite2 import backprop, driver
from numpy.typing import NDArray
from scipy.optimize import minimize

from identification.recording import Floats

SCALE_STEP = 8.0
"""Ratio of neighbouring time scales."""
MOST_SCALES = 4
"""celerite2 0.3.3 gives wrong slopes for more than four columns (its tests stop there)."""
FEW_ROWS = 100
"""With fewer rows the noise is taken as white."""
OUTLIER = 4.0
"""Whitened residuals beyond this get a variance of their own size."""
LEAST_SHARE = 1e-12
"""Variances are kept above this share of the residual's."""
MOST_REMEMBERED = 8
"""Sets of scales and bands whose matrices are kept with the rows."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Where one run's response was measured."""

    time: Floats
    """(n,) s, ascending."""
    count: Floats
    """(n,) samples in each row."""
    extra: Floats
    """(n,) variance factor of the white part, above 1 for outliers."""
    width: Floats
    """(n,) s over which the samples of a row are spread."""
    memo: dict[object, Shape] = field(default_factory=dict, init=False, repr=False)
    """(scales, bands) -> the matrices of the noise on these rows at unit variances."""


@dataclass(frozen=True, eq=False, slots=True)
class Shape:
    """What the covariance on some rows has of the scales and bands alone: all variances are factors of it."""

    c: Floats
    """(J,) 1/s, celerite's decay of each column."""
    gain2: Floats
    """(n, components) variance that the mean over a row leaves of each."""
    U: Floats
    """(n, J) at unit variances."""
    V: Floats
    """(n, J)."""


@dataclass(frozen=True)
class Noise:
    """Variances in the square of the response's unit, times in s."""

    white: float
    """Of one sample."""
    proportional: float
    """Of one sample, relative to |F| squared."""
    scales: tuple[float, ...] = ()
    slow: tuple[float, ...] = ()
    bands: tuple[tuple[float, float], ...] = ()
    """(frequency in Hz, quality) of each damped oscillator."""
    band: tuple[float, ...] = ()

    @property
    def variances(self) -> Floats:
        return np.array([self.white, self.proportional, *self.slow, *self.band])

    def with_variances(self, values: Floats) -> Noise:
        J = len(self.scales)
        return replace(
            self,
            white=float(values[0]),
            proportional=float(values[1]),
            slow=tuple(map(float, values[2 : 2 + J])),
            band=tuple(map(float, values[2 + J :])),
        )

    def correlated(self, rows: Rows, size: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """c, a, U, V of celerite's matrices for rows at which the force is `size` (n,)."""
        diag = (self.white + self.proportional * size**2) * rows.extra / rows.count
        shape = self.shape(rows)
        spread = np.array([*self.slow, *self.band])
        a = diag + shape.gain2 @ spread if spread.size else diag
        columns = np.repeat(spread, [1] * len(self.slow) + [2] * len(self.band))
        return shape.c, a, shape.U * columns, shape.V

    def shape(self, rows: Rows) -> Shape:
        """As a search for variances asks for it again and again."""
        key = (self.scales, self.bands)
        known = rows.memo.get(key)
        if known is None:
            if len(rows.memo) >= MOST_REMEMBERED:
                rows.memo.clear()
            known = rows.memo[key] = self._shape(rows)
        return known

    def _shape(self, rows: Rows) -> Shape:
        unit = replace(self, slow=(1.0,) * len(self.scales), band=(1.0,) * len(self.bands))
        ac, bc, cc, dc = unit._oscillators()
        ar, cr = np.array(unit.slow), 1 / np.array(self.scales) if self.scales else np.empty(0)
        n, J = rows.time.size, ar.size + 2 * ac.size
        _, U, V = driver.get_celerite_matrices(
            ar, ac, bc, dc, rows.time, np.zeros(n), np.empty(n), np.empty((n, J)), np.empty((n, J))
        )
        gain = self.gains(rows)
        wide = np.repeat(gain, [1] * ar.size + [2] * ac.size, axis=1)
        c = np.concatenate([cr, np.repeat(cc, 2)])
        return Shape(c, gain**2, np.ascontiguousarray(U * wide), np.ascontiguousarray(V * wide))

    def gains(self, rows: Rows) -> Floats:
        """(n, components): what the mean of a row's samples leaves of each, as a factor of its standard deviation."""
        spacing = rows.width / rows.count
        rates = [-1 / T + 0j for T in self.scales]
        rates += [complex(-np.pi * f / Q, 2 * np.pi * f) for f, Q in self.bands]
        return (
            np.column_stack([_mean_gain(np.exp(r * spacing), rows.count) for r in rates])
            if rates
            else np.empty((rows.time.size, 0))
        )

    def _oscillators(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Underdamped harmonic oscillators with unit-height kernels times their variance."""
        f = np.array([b[0] for b in self.bands])
        Q = np.array([b[1] for b in self.bands])
        a = np.array(self.band)
        w = 2 * np.pi * f
        root = np.sqrt(np.maximum(4 * Q**2 - 1, 1e-9))
        return a, a / root, 0.5 * w / Q if Q.size else Q, 0.5 * w * root / Q if Q.size else Q


def _mean_gain(rho: NDArray[np.complex128], m: Floats) -> Floats:
    """Standard deviation of the mean of m even samples whose correlation over k samples is Re rho^k."""
    far = 1 - rho
    variance = np.real((1 + rho) / far - 2 * rho * (1 - rho**m) / (m * far**2)) / m
    out: Floats = np.sqrt(np.clip(np.where(m > 1.5, variance, 1.0), 1e-6, 1.0))
    return out


class Whitener:
    """The factored covariance of one run's rows."""

    def __init__(self, noise: Noise, rows: Rows, size: Floats) -> None:
        self.noise, self.rows = noise, rows
        self._c, a, self._U, V = noise.correlated(rows, size)
        n, J = self._U.shape
        if J == 0:
            self._d, self._W = a, V
        else:
            self._d, self._W = driver.factor(rows.time, self._c, a, self._U, V, np.empty(n), np.empty((n, J)))
        self._root = np.sqrt(self._d)

    @property
    def log_det(self) -> float:
        return float(np.sum(np.log(self._d)))

    def whiten(self, columns: Floats) -> Floats:
        """L^-1 columns for K = L L'; (n,) or (n, p)."""
        flat = columns.ndim == 1
        Y = np.ascontiguousarray(columns[:, None] if flat else columns)
        if self._U.shape[1]:
            Y = driver.solve_lower(self.rows.time, self._c, self._U, self._W, Y, np.empty_like(Y))
        Z: Floats = Y / self._root[:, None]
        return Z[:, 0] if flat else Z


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


def with_outliers(rows: Rows, whitened: Floats) -> Rows:
    """Rows whose whitened residual is beyond OUTLIER get the variance that makes it OUTLIER/2."""
    far = np.abs(whitened) > OUTLIER
    extra = np.where(far, np.maximum((whitened / (0.5 * OUTLIER)) ** 2, 1.0), 1.0)
    return replace(rows, extra=extra)
