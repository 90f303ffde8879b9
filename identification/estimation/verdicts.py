"""What a fit allows one to say: significance, underfit, whiteness. Each verdict is data with a sentence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.estimation.ljung_box import ljung_box
from identification.estimation.tails import chi2_sf, fisher_sf, student_quantile, student_sf
from identification.recording import Floats

ALPHA = 0.05
"""Level of every test here unless told otherwise (thesis section 4.1.3: "usually 5 %")."""


@dataclass(frozen=True, slots=True)
class Significance:
    """Test of h0: parameter = 0 (eq. 4.11)."""

    value: float
    std: float
    percent: float
    """100 std / |value|, the left side of eq. 4.11."""
    threshold: float
    """Its right side, 100 / c; 51.02 % for alpha = 5 % and known variance."""
    significant: bool
    p_value: float

    @property
    def statement(self) -> str:
        if self.significant:
            return f"significant: relative error {self.percent:.3g} % is below {self.threshold:.3g} %"
        left = f"relative error {self.percent:.3g} % is not below {self.threshold:.3g} %"
        return f"not significant: {left} (Indiveri 1998, eq. 4.11)"


def significance(value: float, std: float, dof: float = float("inf"), alpha: float = ALPHA) -> Significance:
    """Eq. 4.11; with an estimated variance (`dof` finite) c is the t quantile instead of the normal one.

    >>> significance(1.0, 0.5).significant, round(significance(1.0, 0.5).threshold, 2)
    (True, 51.02)
    >>> significance(1.0, 0.52).significant
    False
    """
    if not (np.isfinite(value) and np.isfinite(std)):
        return Significance(value, std, float("inf"), 0.0, False, 1.0)
    c = float(student_quantile(1 - alpha / 2, dof)) if dof > 0 else float("inf")
    percent = 100 * std / abs(value) if value != 0 else float("inf")
    ratio = abs(value) / std if std > 0 else (float("inf") if value != 0 else 0.0)
    p_value = float(2 * student_sf(ratio, dof)) if dof > 0 else 1.0
    return Significance(value, std, percent, 100 / c, bool(ratio > c), p_value)


@dataclass(frozen=True, slots=True)
class Underfit:
    """Chi-square test of the normalised cost J / sigma^2 (section 4.1.3). Only possible when sigma is known."""

    chi2: float
    dof: int
    p_value: float
    underfitted: bool

    @property
    def per_dof(self) -> float:
        return self.chi2 / self.dof if self.dof > 0 else float("nan")

    @property
    def statement(self) -> str:
        if self.dof <= 0:
            return "as many parameters as points: the fit cannot be judged"
        word = "underfitted: residuals exceed their standard errors" if self.underfitted else "not underfitted"
        return f"{word} (chi2/dof {self.per_dof:.3g} with {self.dof} dof, p = {self.p_value:.2g})"


def underfit(chi2: float, dof: int, alpha: float = ALPHA, scale_dof: float = float("inf")) -> Underfit:
    """Is J / sigma^2 too large for chi^2(dof)?

    `scale_dof`: degrees of freedom behind sigma itself, where all points owe theirs to one estimate of the noise; then
    J / (sigma^2 dof) follows F(dof, scale_dof).

    >>> underfit(10.0, 10).underfitted, underfit(30.0, 10).underfitted, underfit(30.0, 10, scale_dof=5).underfitted
    (False, True, False)
    """
    if dof <= 0:
        p_value = 1.0
    elif np.isfinite(scale_dof):
        p_value = float(fisher_sf(chi2 / dof, dof, scale_dof))
    else:
        p_value = float(chi2_sf(chi2, dof))
    return Underfit(chi2, dof, p_value, p_value < alpha)


def residual_variance(residual: Floats, parameters: int) -> float:
    """Eq. 4.12: J_LS / (dim y - dim theta); NaN without degrees of freedom.

    The same J cannot also judge the fit: with sigma^2 from here there is no chi-square test (section 4.1.4).

    >>> residual_variance(np.array([1.0, -1.0, 1.0]), 1)
    1.5
    """
    dof = residual.size - parameters
    return float(residual @ residual) / dof if dof > 0 else float("nan")


@dataclass(frozen=True, slots=True)
class Whiteness:
    """Ljung-Box test that a residual, in the order it was measured, is not correlated with its own past."""

    p_value: float
    lags: int
    white: bool

    @property
    def statement(self) -> str:
        word = (
            "white"
            if self.white
            else "not white: neighbours in time are alike (slow noise, or something the model lacks)"
        )
        return f"residual {word}; Ljung-Box over {self.lags} lags, p = {max(self.p_value, 1e-300):.2g}"


def whiteness(residual: Floats, alpha: float = ALPHA) -> Whiteness | None:
    """Over min(10, n/5) lags (Hyndman's rule); None below 10 residuals.

    >>> whiteness(np.random.default_rng(0).normal(size=200)).white
    True
    """
    n = residual.size
    if n < 10:
        return None
    lags = min(10, n // 5)
    p_value = float(chi2_sf(ljung_box([residual - residual.mean()], [lags]), lags))
    return Whiteness(p_value, lags, p_value >= alpha)
