"""From rows with known, unknown or correlated errors to parameters and the uncertainty of any combination of them.

Two cases. *Known* standard errors (points of holds): weighted least squares (eq. 4.8, 4.9) and a chi-square test.
Where points scatter more than their errors allow, a common excess is added to every variance until chi-square equals
its degrees of freedom (Mandel and Paule, Anal. Chem. 1970): lack of fit and repeatability are the same for quiet and
for noisy holds. *Unknown* ones (level tables, even samples): least squares with the sandwich covariance of errors
correlated along the rows, sigma^2 from eq. 4.12, and no chi-square test.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.fft import dct, idct
from scipy.optimize import brentq

from identification.estimation.even_noise import MIN_SAMPLES, NoiseModel
from identification.estimation.regression import LinearFit, block_noise, correlated_std, least_squares
from identification.estimation.tails import normal_quantile, normal_sf, student_sf
from identification.estimation.verdicts import Underfit, underfit
from identification.recording import Floats

Method = Literal["wls", "ls", "gls"]
"""`gls`: even samples are weighed by the spectrum that their own residual shows (eq. 4.8 with an estimated Sigma)."""


@dataclass(frozen=True, eq=False)
class Rows:
    """y (n,) = H (n, p) theta + e; `blocks` are the rows of each recording, in time order."""

    H: Floats
    y: Floats
    names: tuple[str, ...]
    blocks: tuple[slice, ...]
    std_error: Floats | None = None
    """(n,), all finite and above zero; None when unknown."""
    dof: Floats | None = None
    """(n,) degrees of freedom of the standard errors."""
    most_dof: float = float("inf")
    """Of all standard errors together: they share one spectrum of the noise, so their dof do not simply add up."""
    even: bool = False
    """Errors may be correlated along the rows: even samples, or levels in the order in which they were taken."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Standard deviation of a combination of parameters, its dof, and what eq. 4.9 alone would give."""

    std: float
    dof: float
    internal: float


@dataclass(frozen=True, eq=False)
class Estimate:
    """`excess_std` was added to every standard error, `underfit` judged before that; None without known ones."""

    rows: Rows
    fit: LinearFit
    underfit: Underfit | None
    excess_std: float | None
    internal: LinearFit | None
    """The fit before any excess was added."""
    noise: tuple[NoiseModel, ...] = ()
    """Of each block, for even samples."""

    @property
    def birge_ratio(self) -> float | None:
        """sqrt(chi2 / dof): how far points scatter beyond their standard errors (Birge, Phys. Rev. 1932)."""
        if self.underfit is None or self.underfit.dof <= 0:
            return None
        ratio = np.sqrt(self.underfit.per_dof)
        return float(ratio)

    def spread(self, contrast: Floats) -> Spread:
        """Of contrast @ theta; NaN when the data do not determine it."""
        fit = self.fit
        missing = () if fit.deficiency is None else fit.deficiency.names
        lost = any(bool(contrast[fit.index(name)]) for name in missing)
        if lost or (fit.dof <= 0 and self.internal is None):
            return Spread(float("nan"), 0.0, float("nan"))
        plain = _part(fit, contrast)
        if self.noise:
            std, dof = correlated_std(fit, contrast, self.noise)
            return Spread(std, dof, plain)
        if self.internal is None or self.rows.std_error is None:
            return Spread(plain, float(fit.dof), plain)
        internal = _part(self.internal, contrast)
        if self.excess_std:
            return Spread(plain, float(fit.dof), internal)
        return self._pooled(contrast, internal)

    def _pooled(self, contrast: Floats, internal: float) -> Spread:
        """No excess: standard errors and residuals both measure the noise; average them by their dof."""
        assert self.rows.std_error is not None
        assert self.rows.dof is not None
        assert self.underfit is not None
        parts = (contrast @ self.fit.solver * self.rows.std_error) ** 2
        doubt = float(np.sum(parts**2 / self.rows.dof))
        known = min(float(parts.sum()) ** 2 / doubt if doubt > 0 else float("inf"), self.rows.most_dof)
        if not np.isfinite(known):
            return Spread(internal, known, internal)
        total = known + self.underfit.dof
        return Spread(internal * float(np.sqrt((known + self.underfit.chi2) / total)), total, internal)


def _part(fit: LinearFit, contrast: Floats) -> float:
    """Standard deviation of a combination that leaves out the parameters the data do not determine."""
    used = contrast != 0
    cov = fit.cov[np.ix_(used, used)]
    variance = float(contrast[used] @ cov @ contrast[used])
    return float(np.sqrt(max(variance, 0.0)))


def _judge(rows: Rows, fit: LinearFit) -> Underfit:
    """Chi-square (F) test; a residual over an uncertain standard error counts as the normal deviate of equal rarity."""
    assert rows.std_error is not None
    assert rows.dof is not None
    z = np.abs(fit.residual / rows.std_error)
    finite = np.isfinite(rows.dof)
    rare = np.where(finite, student_sf(z, np.where(finite, rows.dof, 1.0)), normal_sf(z))
    deviate = np.where(rare > 1e-300, -normal_quantile(np.maximum(rare, 1e-300)), z)
    return underfit(float(deviate @ deviate), fit.dof, scale_dof=rows.most_dof)


def excess_std(rows: Rows) -> float:
    """Standard deviation to add to every standard error so that chi2 = dof (Mandel-Paule); 0 when none is needed."""
    assert rows.std_error is not None
    error = rows.std_error

    def surplus(extra: float) -> float:
        fit = least_squares(rows.H, rows.y, rows.names, np.hypot(error, extra))
        assert fit.chi2 is not None
        return fit.chi2 - fit.dof

    plain = least_squares(rows.H, rows.y, rows.names)
    top = 2.0 * float(np.sqrt(plain.residual @ plain.residual / max(plain.dof, 1)))
    if plain.dof <= 0 or surplus(0.0) <= 0 or top == 0.0:
        return 0.0
    return float(brentq(surplus, 0.0, top, rtol=1e-6))


def _weighed_by_spectrum(rows: Rows, noise: tuple[NoiseModel, ...]) -> LinearFit:
    """WLS (eq. 4.8) of the cosine coefficients of each block, which are nearly independent."""
    root = np.empty(rows.y.size)
    for block, model in zip(rows.blocks, noise, strict=True):
        each = model.spectrum(np.arange(1, model.n) / (2 * model.n))
        root[block] = np.sqrt(np.concatenate([[model.n * model.mean_variance()], each]))
    H = np.vstack([dct(rows.H[block], axis=0, norm="ortho") for block in rows.blocks])
    y = np.concatenate([dct(rows.y[block], norm="ortho") for block in rows.blocks])
    if not np.all(root > 0):
        return least_squares(rows.H, rows.y, rows.names)
    fit = least_squares(H, y, rows.names, root)
    solver = np.hstack([idct(fit.solver[:, block], axis=1, norm="ortho") for block in rows.blocks])
    residual = rows.y - rows.H @ fit.theta
    sigma2 = float(residual @ residual) / fit.dof if fit.dof > 0 else float("nan")
    return replace(fit, residual=residual, solver=solver, sigma2=sigma2, chi2=None)


def estimate(rows: Rows, method: Method = "wls") -> Estimate:
    """Parameters of the rows; `ls` ignores known standard errors.

    Even samples: least squares with an honest interval, unless `gls` is asked for. That is efficient under slow noise,
    and gives the slow part of what the model lacks less say, too: under lack of fit the two answers differ.

    >>> rows = Rows(np.array([[1.0], [2.0], [3.0]]), np.array([1.1, 1.9, 3.0]), ("a",), (slice(0, 3),))
    >>> round(float(estimate(rows).fit.theta[0]), 3)
    0.993
    """
    if rows.even or rows.std_error is None or method == "ls":
        fit = least_squares(rows.H, rows.y, rows.names)
        long = rows.even and min(b.stop - b.start for b in rows.blocks) >= MIN_SAMPLES
        noise = block_noise(rows.H, fit.residual, rows.blocks) if long else ()
        if method == "gls" and noise and fit.deficiency is None:
            fit = _weighed_by_spectrum(rows, noise)
        return Estimate(rows, fit, None, None, None, noise)
    internal = least_squares(rows.H, rows.y, rows.names, rows.std_error)
    verdict = _judge(rows, internal)
    if not verdict.underfitted:
        return Estimate(rows, internal, verdict, 0.0, internal)
    extra = excess_std(rows)
    fit = least_squares(rows.H, rows.y, rows.names, np.hypot(rows.std_error, extra))
    return Estimate(rows, fit, verdict, extra, internal)
