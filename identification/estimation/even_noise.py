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

from identification.estimation.tails import student_quantile
from identification.recording import Floats

SHARES = (0.0, 0.01, 0.03, 0.1, 0.3, 0.6, 0.85, 0.97, 1.0)
"""Share of the variance that is correlated, grid of the posterior; white noise has half of the prior."""
FLICKER = 0.2
"""Share of the prior of correlated noise that flicker has. More of it overstates the error of a mean under first-order
noise (0.5 of it: by 4 %, coverage 98 for 95 % with 120 samples at a lag-1 correlation of 0.5) and gains nothing under
1/f noise (benchmarks/estimation/estimators.py)."""
TAU_MIN = 0.5
"""Samples; the grid of time constants goes up by sqrt(2)."""
TAU_MAX = 0.4
"""Longest time constant as a fraction of the window: slower noise looks like drift and is told by the drift slope."""
BIN_GROWTH = 1.2
"""Frequency bins widen by this ratio; the first ones hold one coefficient each."""
SAMPLES_PER_BIN = 8
"""Frequencies at which a spectrum is evaluated in one bin."""
MIN_SAMPLES = 5
"""Fewer samples carry no usable information on their own correlation."""

_DOF: Floats = np.geomspace(1.0, 1e4, 80)
_T95: Floats = student_quantile(0.975, _DOF)
_ONE_SIGMA = 0.3173105078629141
_RATIO: Floats = _T95 / student_quantile(1 - _ONE_SIGMA / 2, _DOF)


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
    """Everything of the posterior that depends on the number of samples only.

    K shapes (first order, then flicker, each by time constant), S shares, B frequency bins, G = S K grid points.
    """

    starts: np.ndarray[tuple[int], np.dtype[np.intp]]
    counts: Floats
    """Coefficients in each bin, (B,)."""
    centre: Floats
    """cycles per sample, (B,)"""
    spectra: Floats
    """Unit-variance spectra (G, B)."""
    log_spectra: Floats
    mean_variance: Floats
    """Variance of the mean under each of them, (G,)."""
    log_prior: Floats


def _bins(n: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    edges = [1]
    while edges[-1] < n:
        edges.append(min(n, max(edges[-1] + 1, int(np.ceil(edges[-1] * BIN_GROWTH)))))
    return np.array(edges, dtype=np.intp)


def time_constants(n: int, longest: float = TAU_MAX) -> int:
    """How many time constants the grid of a window of n samples has, the last one near `longest` x n."""
    return 2 + int(2 * np.log2(max(longest * n / TAU_MIN, 4.0)))


@lru_cache(maxsize=16)  # holds of one campaign are of few lengths; each is 0.1 to 0.8 MB, and made in 0.5 ms
def _grid(n: int, constants: int) -> _Grid:
    edges = _bins(n)
    counts = np.diff(edges).astype(np.float64)
    inside = edges[:-1, None] + (counts[:, None] - 1) * np.linspace(0, 1, SAMPLES_PER_BIN)
    tau = TAU_MIN * 2.0 ** (np.arange(constants) / 2)
    first = ar1_spectrum(inside.ravel() / (2 * n), tau).reshape(constants, -1, SAMPLES_PER_BIN).mean(axis=2)
    first_mean = ar1_mean_variance(n, tau)
    shapes = np.vstack([first, _octaves(first)])
    shape_mean = np.concatenate([first_mean, _octaves(first_mean)])
    share = np.array(SHARES)[:, None]
    spectra = ((1 - share)[:, :, None] + share[:, :, None] * shapes).reshape(-1, counts.size)
    mean_variance = ((1 - share) / n + share * shape_mean).ravel()
    kind = np.repeat([1 - FLICKER, FLICKER], constants) / constants
    prior = np.tile(0.5 * kind / (len(SHARES) - 1), (len(SHARES), 1))
    prior[0] = 0.5 / len(shapes)
    centre = inside.mean(axis=1) / (2 * n)
    return _Grid(edges[:-1] - 1, counts, centre, spectra, np.log(spectra), mean_variance, np.log(prior.ravel()))


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
        binned = (self.weight * self.variance) @ self.grid.spectra
        out: Floats = np.exp(np.interp(np.log(frequency), np.log(self.grid.centre), np.log(binned)))
        return out

    def combination_std(self, coefficients: Floats) -> tuple[float, float]:
        """Standard deviation and effective degrees of freedom of sum(coefficients * noise), coefficients (n,).

        A least-squares parameter or a slope is such a sum: this is its sandwich covariance in the cosine domain.
        """
        power: Floats = np.square(dct(coefficients, norm="ortho"))
        binned = np.add.reduceat(power[1:], self.grid.starts)
        keep = self.weight > 1e-6
        total = self.grid.spectra[keep] @ binned + power[0] * self.n * self.grid.mean_variance[keep]
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


@dataclass(frozen=True, eq=False)
class Likelihood:
    """How likely n evenly spaced residuals are under each of the G noise laws of a grid."""

    n: int
    grid: _Grid
    log: Floats
    """(G,) with the scale integrated out."""
    variance: Floats
    """(G,) posterior mean of the scale."""


def likelihood(residual: Floats, constants: int, lost: Floats | None) -> Likelihood:
    """The likelihood of each noise law of the grid, of a residual (n,) beside `constants` fitted constants.

    `lost` (n,): the share of each cosine coefficient that a fit took out; None: none.
    Raises ValueError for fewer than MIN_SAMPLES.
    """
    n = residual.size
    if n < MIN_SAMPLES:
        raise ValueError(f"fit_noise needs at least {MIN_SAMPLES} samples, got {n}")
    grid = _grid(n, constants)
    power = dct(residual - residual.mean(), norm="ortho")[1:] ** 2
    binned = np.add.reduceat(power, grid.starts)
    counts = grid.counts
    if lost is not None:
        left = np.clip(1 - lost[1:], 0.0, 1.0)
        counts = np.add.reduceat(left, grid.starts)
    used = float(counts.sum())
    total = np.maximum((1 / grid.spectra) @ binned, 1e-300)
    log = -0.5 * grid.log_spectra @ counts - 0.5 * used * np.log(total)
    variance = total / max(used - 2, 1.0) * (total > 1e-299)
    return Likelihood(n, grid, log, variance)


def fit_noise(residual: Floats, lost: Floats | None = None) -> NoiseModel:
    """Posterior over spectra of an evenly sampled residual (n,), NaN-free, n >= 5.

    The mean never enters (cosine coefficient 0). `lost` (n,) says what share of each cosine coefficient a fit took out
    of the residual (its leverage there, see `leverage`): such coefficients count for less (restricted likelihood).

    >>> model = fit_noise(np.random.default_rng(0).normal(0.0, 2.0, 4000))
    >>> bool(abs(model.std - 2.0) < 0.1)
    True
    """
    found = likelihood(residual, time_constants(residual.size), lost)
    return posterior(found, found.log + found.grid.log_prior)


def posterior(found: Likelihood, log_weight: Floats) -> NoiseModel:
    """The noise laws of the grid weighed by exp(`log_weight`) (G,), which need not be normalised."""
    weight = np.exp(log_weight - log_weight.max())
    return NoiseModel(found.n, weight / weight.sum(), found.variance, found.grid)


def leverage(basis: Floats) -> Floats:
    """Share (n,) of each cosine coefficient that least squares on orthonormal columns (n, p) takes out of its residual.

    >>> leverage(np.full((4, 1), 0.5)).round(6).tolist()
    [1.0, 0.0, 0.0, 0.0]
    """
    out: Floats = np.sum(np.square(dct(basis, axis=0, norm="ortho")), axis=1)
    return out
