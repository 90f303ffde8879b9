"""What wanders slowly, seen through noise: its expected value, given all that was measured.

    value_i = columns_i c + basis_i m(t_i) + e_i

with m a damped oscillator that is pushed at random (of quality 0.5 and more: from a wandering to a hum), e white, and
columns that are fitted. The law of m is found by maximum likelihood on means over blocks; given the law, m is a Kalman
smoother's, in linear time (Foreman-Mackey, Agol, Ambikasaran and Angus 2017, Fast and scalable Gaussian process
modeling with applications to astronomical time series, Astron. J. 154:220). A regression on an expected value is not
attenuated by the noise of what was measured (Berkson 1950, Are there two regressions?, J. Am. Stat. Assoc. 45), one on
measured values is.
"""

from __future__ import annotations

from dataclasses import dataclass

import celerite2
import numpy as np
from celerite2 import terms

from identification.recording import Floats

BLOCKS = 1000
"""Means of neighbouring rows that the law is found on, at most."""
LEAST_BLOCKS = 40
STARTS = (0.02, 0.1)
"""Periods from which the likeliest law is sought, of the whole time."""
QUALITY = (0.5, 200.0)
SHORTEST = 4.0
"""Blocks in the shortest period."""
LONGEST = 2.0
"""Times of all the time: the longest period."""
FAINTEST = 1e-3
"""Of the noise of a block: the least that wanders."""
STEP = 1e-4
"""Of the logarithms, for a slope."""
FLOOR = 1e-3
"""Of the largest basis: below it a row tells nothing of m."""


@dataclass(frozen=True, slots=True)
class Law:
    """Of m and of the noise."""

    std: float
    """Of m."""
    frequency: float
    """rad/s."""
    quality: float
    noise: float
    """Standard deviation of e where a row is the mean of one sample."""

    def process(self, at: Floats, weight: Floats) -> celerite2.GaussianProcess:
        """Of what rows of these weights tell of m. Raises LinAlgError where that is no covariance."""
        kernel = terms.SHOTerm(sigma=self.std, w0=self.frequency, Q=self.quality)
        process = celerite2.GaussianProcess(kernel, mean=0.0)
        process.compute(at, diag=self.noise**2 / weight)
        return process


def law_of(at: Floats, told: Floats, weight: Floats) -> Law | None:
    """The likeliest for rows at `at` (n,) s that tell m = `told` (n,), `weight` (n,) the inverse of its variance for a
    noise of 1; None where too few blocks of them tell anything."""
    from scipy.optimize import minimize  # a quarter of a second, for recordings with a rate alone

    at, told, weight = _blocks(at, told, weight)
    if at.size < LEAST_BLOCKS or not np.any(told):
        return None
    step, span = float(np.median(np.diff(at))), float(at[-1] - at[0])
    apart = np.abs(np.diff(told)) * np.sqrt(weight[1:] * weight[:-1] / (weight[1:] + weight[:-1]))
    typical = 1.0 / float(np.sqrt(np.median(weight)))
    size = max(float(np.median(apart)) / 0.6745, 1e-9 * float(np.max(np.abs(told))) / typical)
    told, noise, least = told / size, 1.0, FAINTEST * typical
    ranges = np.log(
        [
            (least, max(3.0 * float(np.std(told)), 2.0 * least)),
            (2 * np.pi / (LONGEST * span), 2 * np.pi / (SHORTEST * step)),
            QUALITY,
            (0.1 * noise, 10.0 * noise),
        ]
    )

    def lost(logs: Floats) -> float:
        try:
            return -float(Law(*np.exp(logs).tolist()).process(at, weight).log_likelihood(told))
        except np.linalg.LinAlgError:
            return np.inf

    begins = [np.log([float(np.std(told)), 2 * np.pi / (share * span), 1.0, noise]) for share in STARTS]
    found = [
        minimize(lost, np.clip(b, *ranges.T), method="L-BFGS-B", bounds=ranges.tolist(), options={"eps": STEP})
        for b in begins
    ]
    best = min(found, key=lambda each: float(each.fun))
    if not np.isfinite(best.fun):
        return None
    std, frequency, quality, noise = np.exp(best.x).tolist()
    return Law(std * size, frequency, quality, noise * size)


def _blocks(at: Floats, told: Floats, weight: Floats) -> tuple[Floats, Floats, Floats]:
    """Means of neighbours and their weights."""
    starts = np.arange(0, at.size, max(-(-at.size // BLOCKS), 1))
    total = np.add.reduceat(weight, starts)
    return np.add.reduceat(weight * at, starts) / total, np.add.reduceat(weight * told, starts) / total, total


class Smoother:
    """c and m for values at rows: fixed numbers applied to any values, so a fit that moves the values moves smoothly.

    `at` (n,) s, ascending; `columns` (n, p); `basis` (n,); `count` (n,) samples in each row. The law is that of `usual`
    (n,) values. Raises LinAlgError.
    """

    def __init__(self, at: Floats, columns: Floats, basis: Floats, count: Floats, usual: Floats) -> None:
        self.columns = columns
        root = np.sqrt(count)
        self._solve = np.linalg.pinv(columns * root[:, None], rcond=1e-10) * root
        size = np.abs(basis)
        self._kept = size > FLOOR * float(size.max(initial=0.0))
        self._at, self._basis = at[self._kept], basis[self._kept]
        weight = (self._basis**2 * count[self._kept]).astype(np.float64)
        self.law = law_of(self._at, self._told(usual), weight) if self._kept.any() else None
        self._process = None if self.law is None else self.law.process(self._at, weight)

    def _told(self, values: Floats) -> Floats:
        left: Floats = values - self.columns @ (self._solve @ values)
        return left[self._kept] / self._basis

    def __call__(self, values: Floats, at: Floats) -> tuple[Floats, Floats]:
        """C (p,) and m at the times `at`; m is 0 where no law was found."""
        c: Floats = self._solve @ values
        if self._process is None:
            return c, np.zeros_like(at)
        found = self._process.predict(self._told(values))
        return c, np.asarray(np.interp(at, self._at, found))
