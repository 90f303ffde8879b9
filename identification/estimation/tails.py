"""Tails and quantiles of the laws that tests are judged by, right down to the smallest float, and quick to import.

scipy.special has what scipy.stats is made of, and comes up half a second sooner. The tail of the non-central chi-square
is its Poisson mixture, summed where it has weight: one minus the distribution function is nothing below 1e-16.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc, gammaincc, gammaincinv, gammaln, ndtr, ndtri, stdtr, stdtrit

from identification.recording import Floats

REACH = 12.0
"""Standard deviations of the Poisson law on either side of what is summed."""
AROUND = 40
"""Terms that are summed beside those."""


def chi2_sf(x: Floats | float, dof: Floats | float) -> Floats:
    """P(chi-square of `dof` > x).

    >>> round(float(chi2_sf(3.841459, 1)), 4)
    0.05
    """
    out: Floats = np.asarray(chdtrc(dof, np.maximum(x, 0.0)), dtype=np.float64)
    return out


def chi2_isf(p: float, dof: float) -> float:
    """Value that chi-square of `dof` exceeds with probability p."""
    return float(chdtri(dof, p))


def normal_sf(x: Floats | float) -> Floats:
    """P(standard normal > x)."""
    out: Floats = np.asarray(ndtr(np.negative(x)), dtype=np.float64)
    return out


def normal_quantile(p: Floats | float) -> Floats:
    """Value that a standard normal stays below with probability p.

    >>> round(float(normal_quantile(0.975)), 4)
    1.96
    """
    out: Floats = np.asarray(ndtri(p), dtype=np.float64)
    return out


def student_sf(x: Floats | float, dof: Floats | float) -> Floats:
    """P(Student's t of `dof` > x); infinitely many are the normal law."""
    known = np.isposinf(dof)
    out: Floats = np.where(known, ndtr(np.negative(x)), stdtr(np.where(known, 1.0, dof), np.negative(x)))
    return out


def student_quantile(p: float, dof: Floats | float) -> Floats:
    """Value that Student's t of `dof` stays below with probability p; infinitely many are the normal law, 0 give NaN.

    >>> round(float(student_quantile(0.975, 10)), 4), round(float(student_quantile(0.975, float("inf"))), 4)
    (2.2281, 1.96)
    """
    known = np.isposinf(dof)
    out: Floats = np.where(known, ndtri(p), stdtrit(np.where(known, 1.0, dof), p))
    return out


def fisher_sf(x: Floats | float, above: float, below: float) -> Floats:
    """P(Fisher's F of `above` and `below` degrees of freedom > x)."""
    out: Floats = np.asarray(fdtrc(above, below, np.maximum(x, 0.0)), dtype=np.float64)
    return out


def gamma_sf(x: Floats | float, shape: float) -> Floats:
    """P(gamma variate of `shape` and scale 1 > x)."""
    out: Floats = np.asarray(gammaincc(shape, np.maximum(x, 0.0)), dtype=np.float64)
    return out


def gamma_median(shape: float) -> float:
    """The median of a gamma distribution of that shape and scale 1."""
    return float(gammaincinv(shape, 0.5))


def noncentral_chi2_sf(x: float, dof: float, noncentrality: float) -> float:
    """P(non-central chi-square > x): sum over j of Poisson(j; noncentrality/2) P(chi-square of dof + 2 j > x).

    For one degree of freedom two normal tails: (z + sqrt(noncentrality))^2 > x.
    """
    if x <= 0:
        return 1.0
    if noncentrality == 0:
        return float(chi2_sf(x, dof))
    if dof == 1:
        root, shift = np.sqrt(x), np.sqrt(noncentrality)
        return float(ndtr(shift - root) + ndtr(-shift - root))
    return poisson_mixture(x, dof, noncentrality)


def poisson_mixture(x: float, dof: float, noncentrality: float) -> float:
    """The sum itself, for x and noncentrality above 0; relative error below 1e-8 for noncentralities up to 1e6."""
    half = 0.5 * noncentrality
    # far out the sum has its weight where j (dof/2 + j) = half x/2, not at the mean of the Poisson law
    weight = 0.5 * (np.sqrt(0.25 * dof**2 + 2 * half * x) - 0.5 * dof)
    low, high = min(half, weight), max(half, weight)
    first = max(int(low - REACH * np.sqrt(low + 1)) - AROUND, 0)
    j = np.arange(first, int(high + REACH * np.sqrt(high + 1)) + AROUND)
    mass = np.exp(j * np.log(half) - half - gammaln(j + 1))
    return float(min(mass @ gammaincc(0.5 * dof + j, 0.5 * x), 1.0))
