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
RANK = 1e-10
"""Of the largest of them: columns that are smaller, beside the others, are none."""
NOTHING = 1e-9
"""Of what rows tell: less than this beside the columns is rounding."""
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


def law_of(at: Floats, told: Floats, columns: Floats, weight: Floats) -> Law | None:
    """The likeliest for rows at `at` (n,) s that tell c and m, `told` (n,) = columns (n, p) c + m, `weight` (n,) the
    inverse of its variance for a noise of 1; None where too few blocks of them tell anything.

    Likeliest of what the columns cannot hold (Patterson and Thompson 1971, Recovery of inter-block information when
    block sizes are unequal, Biometrika 58:545).
    """
    from scipy.optimize import minimize  # a quarter of a second, for recordings with a rate alone

    at, told, columns, weight = _blocks(at, told, columns, weight)
    if at.size < LEAST_BLOCKS:
        return None
    columns = _apart(columns, np.sqrt(weight))
    left = told - columns @ (columns.T @ (weight * told))
    if not np.any(np.abs(left) > NOTHING * float(np.max(np.abs(told)))):
        return None
    step, span = float(np.median(np.diff(at))), float(at[-1] - at[0])
    apart = np.abs(np.diff(left)) * np.sqrt(weight[1:] * weight[:-1] / (weight[1:] + weight[:-1]))
    typical = 1.0 / float(np.sqrt(np.median(weight)))
    size = max(float(np.median(apart)) / 0.6745, 1e-9 * float(np.max(np.abs(left))) / typical)
    told, left, noise, least = told / size, left / size, 1.0, FAINTEST * typical
    ranges = np.log(
        [
            (least, max(3.0 * float(np.std(left)), 2.0 * least)),
            (2 * np.pi / (LONGEST * span), 2 * np.pi / (SHORTEST * step)),
            QUALITY,
            (0.1 * noise, 10.0 * noise),
        ]
    )

    def lost(logs: Floats) -> float:
        try:
            return _lost(Law(*np.exp(logs).tolist()).process(at, weight), told, columns)
        except np.linalg.LinAlgError:
            return np.inf

    begins = [np.log([float(np.std(left)), 2 * np.pi / (share * span), 1.0, noise]) for share in STARTS]
    found = [
        minimize(lost, np.clip(b, *ranges.T), method="L-BFGS-B", bounds=ranges.tolist(), options={"eps": STEP})
        for b in begins
    ]
    best = min(found, key=lambda each: float(each.fun))
    if not np.isfinite(best.fun):
        return None
    std, frequency, quality, noise = np.exp(best.x).tolist()
    return Law(std * size, frequency, quality, noise * size)


def _lost(process: celerite2.GaussianProcess, told: Floats, columns: Floats) -> float:
    """Less the logarithm of the likelihood of what `columns` (n, p) cannot hold of `told` (n,)."""
    whitened = process.apply_inverse(columns)
    normal = columns.T @ whitened
    c = np.linalg.solve(normal, whitened.T @ told)
    return 0.5 * float(np.linalg.slogdet(normal)[1]) - float(process.log_likelihood(told - columns @ c))


def _apart(columns: Floats, root: Floats) -> Floats:
    """(n, q) what columns (n, p) span, at right angles to each other where rows weigh `root` (n,)."""
    left, size, _ = np.linalg.svd(columns * root[:, None], full_matrices=False)
    return np.asarray(left[:, size > RANK * size[0]] / root[:, None])


def _blocks(at: Floats, told: Floats, columns: Floats, weight: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Means of neighbours and their weights."""
    starts = np.arange(0, at.size, max(-(-at.size // BLOCKS), 1))
    total = np.add.reduceat(weight, starts)
    means = np.add.reduceat(weight[:, None] * np.column_stack([at, told, columns]), starts) / total[:, None]
    return means[:, 0], means[:, 1], means[:, 2:], total


class Smoother:
    """c and m for values at rows: fixed numbers applied to any values, so a fit that moves the values moves smoothly.

    `at` (n,) s, ascending; `columns` (n, p); `basis` (n,); `count` (n,) samples in each row. The law is that of `usual`
    (n,) values. c is what is likeliest beside an m that wanders: what comes and goes while the driver happens to be at
    one level is not taken for a part of the curve. Raises LinAlgError.
    """

    def __init__(self, at: Floats, columns: Floats, basis: Floats, count: Floats, usual: Floats) -> None:
        size = np.abs(basis)
        self._kept = kept = size > FLOOR * float(size.max(initial=0.0))
        self._at, self._basis, self._columns = at[kept], basis[kept], columns[kept] / basis[kept, None]
        weight = (self._basis**2 * count[kept]).astype(np.float64)
        told = usual[kept] / self._basis
        self.law = law_of(self._at, told, self._columns, weight) if kept.any() else None
        self._process = None if self.law is None else self.law.process(self._at, weight)
        self._solve = self._solved(columns, count)

    def _solved(self, columns: Floats, count: Floats) -> Floats:
        """(p, n) that makes c of values."""
        root = np.sqrt(count)
        left, size, right = np.linalg.svd(columns * root[:, None], full_matrices=False)
        known = size > RANK * size[0]
        back = right[known].T / size[known]
        if self._process is None or self.law is None:
            return np.asarray(back @ (left[:, known].T * root))
        whitened = left[:, known] * (root / self.law.noise**2)[:, None]
        whitened[self._kept] = self._process.apply_inverse(self._columns @ back) / self._basis[:, None]
        return np.asarray(back @ np.linalg.solve((columns @ back).T @ whitened, whitened.T))

    def curve(self, values: Floats) -> Floats:
        """C (p,) beside what wanders."""
        return np.asarray(self._solve @ values)

    def __call__(self, values: Floats, at: Floats) -> tuple[Floats, Floats]:
        """C (p,) and m at the times `at`; m is 0 where no law was found."""
        c = self.curve(values)
        if self._process is None:
            return c, np.zeros_like(at)
        found = self._process.predict(values[self._kept] / self._basis - self._columns @ c)
        return c, np.asarray(np.interp(at, self._at, found))
