"""Monte Carlo of an estimator against the one that attains the Cramér-Rao bound, run on the same data.

The reference error of a draw is `bound J' Sigma^-1 e` with the true Jacobian and the true covariance of the noise: its
covariance is the bound itself. The estimate follows it closely, so that ratio of variances and coverage are known far
better from the pair than from the estimate alone (common random numbers, control variates).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_factor, cho_solve, toeplitz
from scipy.stats import norm
from scipy.stats import t as student

from tests.identification.thrust_runs import ar1, white

LEVELS = (0.68, 0.95)
NOISES = {"white": 0.0, "AR(1) 0.5": 0.5, "AR(1) 0.9": 0.9}


@dataclass
class Draw:
    """Of one data set; all (p,). NaN error: the estimator gave nothing."""

    error: np.ndarray
    std: np.ndarray
    dof: np.ndarray
    reference: np.ndarray
    bound: np.ndarray
    """Standard deviations of the reference."""


@dataclass
class Case:
    name: str
    noise: str
    parameters: tuple
    draw: Callable[[np.random.Generator], Draw]
    cheap: int = 1
    """Runs are multiplied by this."""
    remark: str = ""


@dataclass
class Sample:
    """Arrays (N, p) of N draws."""

    error: np.ndarray
    std: np.ndarray
    dof: np.ndarray
    reference: np.ndarray
    bound: np.ndarray

    def joined(self, other):
        parts = vars(self)
        return Sample(**{k: np.vstack([v, getattr(other, k)]) for k, v in parts.items()})

    @property
    def runs(self):
        return len(self.error)


@dataclass
class Result:
    """One line of the table."""

    parameter: str
    runs: int
    failed: int
    bias: float
    """In standard errors of the mean."""
    bias_share: float
    """Of the bound's standard deviation, from the pairs."""
    ratio: float
    """Variance over bound, from the pairs."""
    ratio_error: float
    plain_ratio: float
    """Variance over bound from the estimates alone."""
    plain_error: float
    coverage: tuple
    """(share, its standard error) of each of LEVELS, from the pairs."""
    width: float
    """Median stated standard deviation over the true one."""


def sample(case, runs, seed):
    """`runs` draws; every draw has a random stream of its own, so that a run can be continued."""
    draws = [case.draw(np.random.default_rng([seed, i])) for i in runs]
    return Sample(*(np.array([getattr(d, f) for d in draws]) for f in ("error", "std", "dof", "reference", "bound")))


def controlled(y, x, mean):
    """Mean of y and its standard error, with x whose mean is known as control variate."""
    n = y.size
    if np.ptp(x) == 0 or np.ptp(y) == 0:
        return float(y.mean()), float(max(y.std(), 1 / n) / np.sqrt(n))
    slope = float(np.cov(x, y)[0, 1] / x.var(ddof=1))
    left = y - slope * (x - mean)
    return float(left.mean()), float(left.std(ddof=2) / np.sqrt(n))


def results(case, found):
    """One Result per parameter."""
    out = []
    for j, name in enumerate(case.parameters):
        good = np.isfinite(found.error[:, j]) & np.isfinite(found.std[:, j])
        e, s, d, r, b = (getattr(found, f)[good, j] for f in ("error", "std", "dof", "reference", "bound"))
        n, z, x = e.size, e / b, r / b
        ratio, error = controlled((z - z.mean()) ** 2 * n / (n - 1), x**2, 1.0)
        share, _ = controlled(z, x, 0.0)
        plain = float(z.var(ddof=1))
        cover = []
        for level in LEVELS:
            inside = np.abs(e) <= student.ppf(0.5 + level / 2, d) * s
            met, error_met = controlled(inside * 1.0, (np.abs(x) <= norm.ppf(0.5 + level / 2)) * 1.0, level)
            cover.append((met, max(error_met, 1 / n)))  # n pairs that agree still leave 1 in n open
        sem = e.std(ddof=1) / np.sqrt(n)
        spread = float(((z - z.mean()) ** 2).std() / np.sqrt(n))
        out.append(
            Result(
                name, n, int((~good).sum()), float(e.mean() / sem) if sem > 0 else 0.0, share, ratio, error, plain,
                spread, tuple(cover), float(np.median(s) / e.std()),
            )
        )  # fmt: skip
    return out


def covariance(noise, n):
    """Of unit variance, (n, n)."""
    return toeplitz(NOISES[noise] ** np.arange(n))


def drawn(noise, rng, n):
    return (ar1(NOISES[noise]) if NOISES[noise] else white)(rng, n)[0]


@dataclass
class Efficient:
    """The estimator that knows the covariance of the noise: theta = truth + gain @ e."""

    gain: np.ndarray
    bound: np.ndarray

    @property
    def std(self):
        return np.sqrt(np.diag(self.bound))


def efficient(J, Sigma):
    weighed = cho_solve(cho_factor(Sigma), J)
    bound = np.linalg.inv(J.T @ weighed)
    return Efficient(bound @ weighed.T, bound)


def blockwise(noise, lengths, sigma):
    """Inverse covariance of independent stretches of noise, as a function of what it multiplies."""
    solve = [_solver(noise, n) for n in lengths]
    edges = np.cumsum([0, *lengths])

    def times(rows):
        return np.concatenate([f(rows[a:b]) / sigma**2 for f, (a, b) in zip(solve, pairwise(edges), strict=True)])

    return times


@lru_cache(maxsize=64)
def _solver(noise, n):
    factor = cho_factor(covariance(noise, n))
    return lambda rows: cho_solve(factor, rows)


def efficient_blockwise(J, noise, lengths, sigma):
    weighed = blockwise(noise, lengths, sigma)(J)
    bound = np.linalg.inv(J.T @ weighed)
    return Efficient(bound @ weighed.T, bound)
