"""Everything section 4.1 says of one linear fit, in one place, corrected for correlated residuals and not.

Rows are samples in the order they were taken, even in time. With a known sigma the fit can be judged (chi-square,
section 4.1.3); without it sigma is estimated from the residual (eq. 4.12) and there is nothing left to judge with:
the same residual cannot do both (section 4.1.4). Correlated residuals are worth fewer samples than they are many, so
the printed formulas promise too much; each figure here stands beside the one that allows for the correlation found.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from identification.estimation.even_noise import MIN_SAMPLES, NoiseModel, leverage
from identification.estimation.information import Excitation, Information, excitation, linear_information
from identification.estimation.regression import RANK_TOLERANCE, LinearFit, block_noise, correlated_std, least_squares
from identification.estimation.singular_values import thin_svd
from identification.estimation.tails import chi2_sf
from identification.estimation.verdicts import (
    ALPHA,
    Significance,
    Underfit,
    Whiteness,
    significance,
    underfit,
    whiteness,
)
from identification.recording import Floats

T = TypeVar("T")
ROUNDING = 1e-12
"""Residuals below this share of the largest y are rounding, not noise."""
LIKELY = 1e-6
"""Spectra less likely than this are left out."""


@dataclass(frozen=True)
class Both(Generic[T]):
    """A figure as printed, for independent errors, and allowing for correlation."""

    plain: T
    corrected: T


@dataclass(frozen=True, eq=False)
class Judgement:
    """`underfit` is None without a known sigma, `sigma` None with one."""

    fit: LinearFit
    excitation: Excitation
    information: Information
    """With the known sigma, else with the estimated one; for independent errors."""
    std: Mapping[str, Both[float]]
    significance: Mapping[str, Both[Significance]]
    """Eq. 4.11."""
    sigma: Both[float] | None
    """Standard deviation of one sample: eq. 4.12; corrected for what a fit takes out of slow noise."""
    underfit: Both[Underfit] | None
    whiteness: Whiteness | None
    dof: Both[float]
    """Of the residual: n - p, and what that is worth."""
    exact: bool = False
    """No sigma was given and the residual shows none: nothing can be said of any error."""

    @property
    def insignificant(self) -> tuple[str, ...]:
        """Parameters that might just as well be zero, the least significant one first (correlation allowed for)."""
        weak = [name for name, found in self.significance.items() if not found.corrected.significant]
        return tuple(sorted(weak, key=lambda name: -self.significance[name].corrected.p_value))

    @property
    def statements(self) -> tuple[str, ...]:
        out = [self.excitation.statement]
        for name, tested in self.significance.items():
            std = self.std[name]
            if not np.isfinite(std.plain):
                continue
            figures = f"{self.fit.theta[self.fit.index(name)]:.4g} ± {std.corrected:.2g} (uncorrected {std.plain:.2g})"
            out.append(f"{name} = {figures}, {tested.corrected.statement}")
        if self.exact:
            out.append("the residual is zero to rounding: it shows no noise to judge by; give sigma where it is known")
            return tuple(out)
        if self.underfit is not None:
            judged = self.underfit
            out.append(f"{judged.corrected.statement}; taken as independent: {judged.plain.statement}")
        if self.sigma is not None:
            found = f"{self.sigma.corrected:.3g} (uncorrected {self.sigma.plain:.3g})"
            source = "was estimated from the residual (Indiveri 1998, eq. 4.12)"
            out.append(f"sigma = {found} {source}: it cannot judge the fit as well")
        return (*out, *(() if self.whiteness is None else (self.whiteness.statement,)))


def judge(H: Floats, y: Floats, names: tuple[str, ...], sigma: float | None = None, alpha: float = ALPHA) -> Judgement:
    """LS of y (n,) on H (n, p) and its judgement; `sigma`: standard deviation of one sample, when it is known.

    Raises ValueError for shapes that do not fit, numbers that are not finite, a sigma that is none.

    >>> x = np.arange(60.0)
    >>> y = 2 * x + np.random.default_rng(0).standard_normal(60)
    >>> found = judge(np.column_stack([x, np.ones(60)]), y, ("slope", "offset"), sigma=1.0)
    >>> found.insignificant, found.underfit.corrected.underfitted, found.sigma
    (('offset',), False, None)
    """
    fit = least_squares(H, y, names)
    known = least_squares(H, y, names, sigma) if sigma is not None else fit
    exact = sigma is None and float(np.abs(fit.residual).max()) <= ROUNDING * float(np.abs(y).max())
    noise = block_noise(H, fit.residual, (slice(0, y.size),)) if y.size >= MIN_SAMPLES and fit.dof > 0 else ()
    spectra = _spectra(H, noise[0], fit.dof) if noise else None
    worth = float(fit.dof) if spectra is None else spectra.average(spectra.worth)
    plain_dof = float("inf") if sigma is not None else float(fit.dof)
    std, verdict = {}, {}
    for i, name in enumerate(names):
        plain, corrected, dof = float("nan") if exact else float(known.std[i]), float("nan"), 0.0
        if np.isfinite(plain):
            corrected, dof = correlated_std(fit, np.eye(len(names))[i], noise) if noise else (plain, plain_dof)
        value = float(fit.theta[i])
        std[name] = Both(plain, corrected)
        verdict[name] = Both(significance(value, plain, plain_dof, alpha), significance(value, corrected, dof, alpha))
    left = _sigma(fit, spectra)
    used = sigma if sigma is not None else left.plain
    return Judgement(
        known,
        excitation(H, names),
        linear_information(H, names, used if used > 0 else 1.0),
        std,
        verdict,
        left if sigma is None else None,
        None if known.chi2 is None else _underfit(known, spectra, alpha),
        whiteness(fit.residual),
        Both(float(fit.dof), worth),
        exact,
    )


@dataclass(frozen=True, eq=False)
class _Spectra:
    """What J is under each noise spectrum of a posterior (g,), the noise having unit variance."""

    weight: Floats
    mean: Floats
    """Expectation of J; n - p for white noise."""
    worth: Floats
    """Degrees of freedom of the scaled chi-square with the mean and variance of J (Satterthwaite)."""

    def average(self, values: Floats) -> float:
        return float(self.weight @ values / self.weight.sum())

    def rarity(self, chi2: float) -> float:
        """Chance of a larger J / sigma^2 than `chi2`, averaged over what the spectrum may be."""
        rare = chi2_sf(chi2 / self.mean * self.worth, self.worth)
        return self.average(rare)


def _spectra(H: Floats, noise: NoiseModel, dof: int) -> _Spectra:
    n, scale, grid = noise.n, np.linalg.norm(H, axis=0), noise.grid
    U, s, _ = thin_svd(H / np.where(scale > 0, scale, 1.0))
    left = np.clip(1 - leverage(U[:, s > RANK_TOLERANCE * s[0]]), 0.0, 1.0)
    keep = noise.weight > LIKELY
    first = left[0] * n * grid.mean_variance[keep]
    mean = grid.spectra[keep] @ np.add.reduceat(left[1:], grid.starts) + first
    square = grid.spectra[keep] ** 2 @ np.add.reduceat(left[1:] ** 2, grid.starts) + first**2
    return _Spectra(noise.weight[keep], mean, np.minimum(mean**2 / square, dof))


def _sigma(fit: LinearFit, spectra: _Spectra | None) -> Both[float]:
    """Eq. 4.12, and with the expectation of J for correlated noise in place of n - p."""
    if fit.sigma2 is None or spectra is None or not fit.sigma2 > 0:
        plain = float(np.sqrt(fit.sigma2)) if fit.sigma2 is not None else float("nan")
        return Both(plain, plain)
    J = fit.sigma2 * fit.dof
    return Both(float(np.sqrt(fit.sigma2)), float(np.exp(0.5 * spectra.average(np.log(J / spectra.mean)))))


def _underfit(known: LinearFit, spectra: _Spectra | None, alpha: float) -> Both[Underfit]:
    """The corrected one keeps J / sigma^2 and n - p as they are: its p-value allows for correlation."""
    assert known.chi2 is not None
    plain = underfit(known.chi2, known.dof, alpha)
    if spectra is None:
        return Both(plain, plain)
    p_value = spectra.rarity(known.chi2)
    return Both(plain, replace(plain, p_value=p_value, underfitted=p_value < alpha))


@dataclass(frozen=True, eq=False)
class Reduced:
    """What remains after insignificant parameters were put to zero, one after the other."""

    dropped: tuple[str, ...]
    """In the order they went."""
    steps: tuple[Judgement, ...]
    """Of the full model first, of what remains last."""

    @property
    def remaining(self) -> Judgement:
        return self.steps[-1]

    @property
    def statement(self) -> str:
        names = ", ".join(self.remaining.fit.names)
        if not self.dropped:
            return f"every parameter is significant: {names}"
        return f"dropped as not significant (Indiveri 1998, eq. 4.11): {', '.join(self.dropped)}; what remains: {names}"


def reduce_model(
    H: Floats,
    y: Floats,
    names: tuple[str, ...],
    sigma: float | None = None,
    keep: tuple[str, ...] = (),
    alpha: float = ALPHA,
) -> Reduced:
    """Drop the least significant parameter (eq. 4.11) and fit anew, until all are significant or one is left.

    One at a time: dropping one changes what the others have to explain. Parameters that the data cannot tell apart
    count as not significant; the last named of them goes first. `keep`: those that stay whatever the test says.

    >>> x = np.arange(60.0)
    >>> y = 2 * x + np.random.default_rng(0).standard_normal(60)
    >>> reduce_model(np.column_stack([x, x**2, np.ones(60)]), y, ("slope", "bend", "offset")).dropped
    ('bend', 'offset')
    """
    left = list(range(len(names)))
    dropped: list[str] = []
    steps = [judge(H, y, names, sigma, alpha)]
    while len(left) > 1:
        weak = [name for name in steps[-1].insignificant if name not in keep]
        lost = steps[-1].fit.deficiency
        unseen = [] if lost is None else [name for name in weak if name in lost.names]
        if not weak:
            break
        gone = max(unseen, key=names.index) if unseen else weak[0]
        dropped.append(gone)
        left.remove(names.index(gone))
        steps.append(judge(H[:, left], y, tuple(names[i] for i in left), sigma, alpha))
    return Reduced(tuple(dropped), tuple(steps))
