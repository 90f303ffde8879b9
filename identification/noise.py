"""Correlated noise of an evenly sampled residual: a posterior over spectra, hence the honest standard error of a mean.

The residual is white noise plus one correlated part: first-order autoregressive with time constant `tau`, or flicker
(equal variance in every octave of time constants up to `tau`: a spectrum near 1/f). Its cosine transform has nearly
independent coefficients with variance S(f_k) (Whittle's likelihood), so the likelihood of a whole grid of such spectra
costs one matrix product. The scale is integrated out. What is not known (which spectrum) widens the interval:
the mean has a mixture of normals as posterior, summed up by a standard deviation and effective degrees of freedom.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import dct
from scipy.special import ndtr
from scipy.stats import t as student

from identification.recording import Floats

SHARES = (0.03, 0.1, 0.3, 0.6, 0.85, 0.97, 1.0)
"""Share of the variance that is correlated, grid of the posterior."""
TAU_COUNT = 14
TAU_MIN = 0.5
"""Samples."""
TAU_MAX = 0.4
"""Longest time constant as a fraction of the window: slower noise looks like drift and is told by the drift slope."""
BIN_GROWTH = 1.2
"""Frequency bins widen by this ratio; the first ones hold one coefficient each."""
SAMPLES_PER_BIN = 8
"""Frequencies at which a spectrum is evaluated in one bin."""
MIN_SAMPLES = 5
"""Fewer samples carry no usable information on their own correlation."""

_DOF: Floats = np.geomspace(1.0, 1e4, 80)
_T95: Floats = np.asarray(student.ppf(0.975, _DOF))
_ONE_SIGMA = 0.3173105078629141
_RATIO: Floats = _T95 / np.asarray(student.ppf(1 - _ONE_SIGMA / 2, _DOF))


def ar1_spectrum(frequency: Floats, tau: Floats) -> Floats:
    """Spectrum (T, F) of first-order noise of unit variance; `frequency` in cycles per sample, `tau` in samples."""
    phi = np.exp(-1.0 / tau)[:, None]
    out: Floats = (1 - phi**2) / (1 + phi**2 - 2 * phi * np.cos(2 * np.pi * frequency)[None, :])
    return out


def ar1_mean_variance(n: int, tau: Floats) -> Floats:
    """Variance (T,) of the mean of n samples of first-order noise of unit variance (exact sum of its autocovariance).

    >>> float(ar1_mean_variance(10, np.array([1e-3]))[0])
    0.1
    """
    phi = np.exp(-1.0 / tau)
    out: Floats = ((1 + phi) / (1 - phi) - 2 * phi * (1 - phi**n) / (n * (1 - phi) ** 2)) / n
    return out


def _octaves(values: Floats) -> Floats:
    """Running mean over the time constants up to each one: first-order noise (T, ...) becomes flicker (T, ...)."""
    count = np.arange(1, len(values) + 1, dtype=np.float64)
    out: Floats = np.cumsum(values, axis=0) / count.reshape(-1, *[1] * (values.ndim - 1))
    return out


@dataclass(frozen=True, eq=False)
class _Grid:
    """Everything of the posterior that depends on the number of samples only."""

    starts: np.ndarray[tuple[int], np.dtype[np.intp]]
    counts: Floats
    centre: Floats
    """cycles per sample, (B,)"""
    shapes: Floats
    """Unit-variance spectra (K, B): row 0 white, then first order, then flicker."""
    shape_mean: Floats
    """Variance of the mean for each shape, (K,)."""
    mix_shape: np.ndarray[tuple[int], np.dtype[np.intp]]
    mix_share: Floats
    inverse: Floats
    """1 / spectrum (G, B) of each grid point."""
    log_volume: Floats
    mean_variance: Floats
    log_prior: Floats


def _bins(n: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    edges = [1]
    while edges[-1] < n:
        edges.append(min(n, max(edges[-1] + 1, int(np.ceil(edges[-1] * BIN_GROWTH)))))
    return np.array(edges, dtype=np.intp)


@lru_cache(maxsize=256)
def _grid(n: int) -> _Grid:
    edges = _bins(n)
    counts = np.diff(edges).astype(np.float64)
    inside = edges[:-1, None] + (counts[:, None] - 1) * np.linspace(0, 1, SAMPLES_PER_BIN)
    tau = np.geomspace(TAU_MIN, max(4 * TAU_MIN, TAU_MAX * n), TAU_COUNT)
    first = ar1_spectrum(inside.ravel() / (2 * n), tau).reshape(TAU_COUNT, -1, SAMPLES_PER_BIN).mean(axis=2)
    first_mean = ar1_mean_variance(n, tau)
    shapes = np.vstack([np.ones((1, counts.size)), first, _octaves(first)])
    shape_mean = np.concatenate([[1.0 / n], first_mean, _octaves(first_mean)])
    coloured = np.arange(1, len(shapes))
    share = np.concatenate([[0.0], np.repeat(SHARES, coloured.size)])
    index = np.concatenate([[0], np.tile(coloured, len(SHARES))]).astype(np.intp)
    spectra = (1 - share)[:, None] + share[:, None] * shapes[index]
    prior = np.concatenate([[0.5], np.full(share.size - 1, 0.5 / (share.size - 1))])
    return _Grid(
        edges[:-1] - 1,
        counts,
        inside.mean(axis=1) / (2 * n),
        shapes,
        shape_mean,
        index,
        share,
        1.0 / spectra,
        np.log(spectra) @ counts,
        (1 - share) / n + share * shape_mean[index],
        np.log(prior),
    )


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """Posterior over noise spectra of n even samples; all methods average over it."""

    n: int
    weight: Floats
    """(G,) probability of each spectrum."""
    variance: Floats
    """(G,) variance of one sample under each spectrum."""
    grid: _Grid

    @property
    def std(self) -> float:
        """Standard deviation of one sample."""
        return float(np.sqrt(self.weight @ self.variance))

    def spectrum(self, frequency: Floats) -> Floats:
        """Posterior mean of the variance of a cosine coefficient at each frequency (cycles per sample, > 0)."""
        level = np.zeros(len(self.grid.shapes))
        mass = self.weight * self.variance
        np.add.at(level, self.grid.mix_shape, mass * self.grid.mix_share)
        level[0] += mass @ (1 - self.grid.mix_share)
        binned = level @ self.grid.shapes
        out: Floats = np.exp(np.interp(np.log(frequency), np.log(self.grid.centre), np.log(binned)))
        return out

    def combination_std(self, coefficients: Floats) -> tuple[float, float]:
        """Standard deviation and effective degrees of freedom of sum(coefficients * noise), coefficients (n,).

        A least-squares parameter or a slope is such a sum: this is its sandwich covariance in the cosine domain.
        """
        power: Floats = np.square(dct(coefficients, norm="ortho"))
        binned = np.add.reduceat(power[1:], self.grid.starts) / self.grid.counts
        keep = self.weight > 1e-6
        spectra = self.grid.counts / self.grid.inverse[keep]
        total = spectra @ binned + power[0] * self.n * self.grid.mean_variance[keep]
        return _mixture_interval(self.weight[keep], np.sqrt(self.variance[keep] * total), self.n - 1)

    def mean_std(self) -> tuple[float, float]:
        """Standard error of the mean and its effective degrees of freedom: t quantile x std is the 95 % half width."""
        keep = self.weight > 1e-6
        std = np.sqrt(self.variance[keep] * self.grid.mean_variance[keep])
        return _mixture_interval(self.weight[keep], std, self.n - 1)

    def mean_variance(self) -> float:
        """Posterior mean of the variance of the sample mean."""
        return float(self.weight @ (self.variance * self.grid.mean_variance))


def _mixture_interval(weight: Floats, std: Floats, most: float) -> tuple[float, float]:
    wide, one = _half_width(weight, std, 0.05), _half_width(weight, std, _ONE_SIGMA)
    if one <= 0:
        return 0.0, most
    log_dof = float(np.interp(wide / one, _RATIO[::-1], np.log(_DOF)[::-1]))
    dof = float(np.exp(log_dof))
    dof = min(dof, most)
    return wide / float(np.interp(np.log(dof), np.log(_DOF), _T95)), dof


def _half_width(weight: Floats, std: Floats, outside: float) -> float:
    """Half width h: a mixture of zero-mean normals lies outside +-h with that probability (bisection in log h)."""
    low, high = float(std.min()) * 0.5, float(std.max()) * 4.0
    if high <= 0:
        return 0.0
    low = max(low, high * 1e-12)
    total = weight.sum()
    for _ in range(16):
        middle = np.sqrt(low * high)
        if weight @ (2 * ndtr(-middle / np.maximum(std, 1e-300))) > outside * total:
            low = middle
        else:
            high = middle
    return float(np.sqrt(low * high))


def fit_noise(residual: Floats, first: int = 1) -> NoiseModel:
    """Posterior over spectra of an evenly sampled residual (n,), NaN-free, n >= 5.

    The mean never enters (cosine coefficient 0). `first=2` leaves coefficient 1 out too: it holds 98.6 % of any linear
    drift, so the noise is then judged as if the drift had been removed.

    >>> model = fit_noise(np.random.default_rng(0).normal(0.0, 2.0, 4000))
    >>> bool(abs(model.std - 2.0) < 0.1)
    True
    """
    n = residual.size
    if n < MIN_SAMPLES:
        raise ValueError(f"fit_noise needs at least {MIN_SAMPLES} samples, got {n}")
    grid = _grid(n)
    power = dct(residual - residual.mean(), norm="ortho")[1:] ** 2
    binned = np.add.reduceat(power, grid.starts)
    counts, log_volume = grid.counts, grid.log_volume
    if first == 2:  # coefficient 1 is a bin of its own
        binned[0] = 0.0
        log_volume = log_volume + np.log(grid.inverse[:, 0])
    n_used = float(counts.sum()) - (first - 1)
    total = np.maximum(grid.inverse @ binned, 1e-300)
    log_weight = grid.log_prior - 0.5 * log_volume - 0.5 * n_used * np.log(total)
    weight = np.exp(log_weight - log_weight.max())
    variance = total / max(n_used - 2, 1.0)
    return NoiseModel(n, weight / weight.sum(), variance * (total > 1e-299), grid)
