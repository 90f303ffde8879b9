"""Models of one thruster side by side: what each residual says, and what remains when a parameter is dropped.

Models with more coefficients always leave less residual. Schwarz's criterion (BIC, Ann. Stat. 1978) charges for each:
-2 log likelihood + p log n. Known standard errors: Gaussian likelihood with one more variance, common to all points,
for what the model lacks (free, so that an underfitted model is not condemned by the smallness of the errors alone).
Unknown ones: n log(RSS / n) with n the *effective* number of samples, since correlated neighbours say a thing twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from identification.estimation.least_squares import Estimate, Rows, estimate
from identification.estimation.regression import least_squares
from identification.thruster.thrust import ThrustFit

POSITIVE = 2.0
"""Difference of BIC that is evidence at all; 6 is strong, 10 very strong (Kass and Raftery, JASA 1995)."""
STRONG, VERY_STRONG = 6.0, 10.0


@dataclass(frozen=True, slots=True)
class Candidate:
    """One model's standing. `bic` is relative to the best; None where the data of the fits are not the same."""

    model: str
    parameters: int
    """Coefficients and tares."""
    rmse: float
    chi2_per_dof: float | None
    underfit_p: float | None
    whiteness_p: float | None
    bic: float | None
    insignificant: tuple[str, ...]
    """Coefficients that eq. 4.11 would drop, and those that the data do not determine."""


@dataclass(frozen=True, slots=True)
class Remainder:
    """The fit without one parameter."""

    dropped: str
    rmse: float
    """N"""
    chi2_per_dof: float | None
    underfit_p: float | None
    others: tuple[tuple[str, float, float], ...]
    """(name, value, standard deviation) of what is left."""


def _same_data(one: Rows, other: Rows) -> bool:
    """The same thrusts; their errors may differ, a measured rate adds its own."""
    known = (one.std_error is None) == (other.std_error is None)
    return known and one.y.shape == other.y.shape and np.array_equal(one.y, other.y)


def _deviance(rows: Rows) -> float:
    """-2 log likelihood (less its constant) at the best common excess variance; standard errors known."""
    assert rows.std_error is not None
    s, y, H, names = rows.std_error, rows.y, rows.H, rows.names

    def of(excess: float) -> float:
        sigma = np.hypot(s, excess)
        chi2 = least_squares(H, y, names, sigma).chi2
        assert chi2 is not None
        return chi2 + 2 * float(np.sum(np.log(sigma)))

    top = max(float(np.abs(y).max()), float(s.max()))
    found = minimize_scalar(
        lambda u: of(float(np.exp(u))), bounds=(np.log(s.min() / 100), np.log(top)), method="bounded"
    )
    return min(of(0.0), float(found.fun))


def effective_samples(fit: ThrustFit) -> float:
    """Independent samples that would have given the first coefficient's standard deviation."""
    n = float(fit.estimate.rows.y.size)
    first = next(iter(fit.parameters.values()))
    if not fit.estimate.noise or not first.std_statistical > 0 or not np.isfinite(first.std_statistical):
        return n
    share = (first.std_uncorrected / first.std_statistical) ** 2
    return float(np.clip(n * share, min(n, len(fit.names) + 2.0), n))


def _rank(found: Estimate) -> int:
    """Parameters that the data determine."""
    return found.rows.y.size - found.fit.dof


def criterion(fit: ThrustFit, n: float) -> float:
    """BIC up to a constant that is the same for all models of the same rows; n effective samples."""
    price = _rank(fit.estimate) * float(np.log(max(n, 2.0)))
    if fit.estimate.internal is not None:
        return _deviance(fit.estimate.rows) + price
    floor = np.finfo(float).eps * float(np.sqrt(np.mean(fit.estimate.rows.y**2))) + 1e-300
    return 2 * n * float(np.log(max(fit.rmse, floor))) + price


def side_by_side(fits: Sequence[ThrustFit]) -> tuple[Candidate, ...]:
    """In the order given; those on other data than the first have no `bic`."""
    same = [fit for fit in fits if _same_data(fits[0].estimate.rows, fit.estimate.rows)]
    n = effective_samples(min(same, key=lambda fit: fit.rmse)) if same else 0.0
    scores = {id(fit): criterion(fit, n) for fit in same}
    best = min(scores.values(), default=0.0)
    return tuple(_candidate(fit, scores[id(fit)] - best if id(fit) in scores else None) for fit in fits)


def _candidate(fit: ThrustFit, bic: float | None) -> Candidate:
    judged, white = fit.estimate.underfit, fit.whiteness
    return Candidate(
        fit.model,
        len(fit.names),
        fit.rmse,
        fit.chi2_per_dof,
        None if judged is None else judged.p_value,
        None if white is None else white.p_value,
        bic,
        tuple(name for name, found in fit.significance.items() if not found.significant),
    )


def statement(candidates: Sequence[Candidate]) -> str:
    """What the comparison says of the first, the chosen one.

    >>> one = Candidate("C V|V|", 2, 1.0, None, None, None, 12.0, ())
    >>> statement([one, replace(one, model="C+/C-", bic=0.0)])
    'C+/C- explains these data better than C V|V|: BIC lower by 12 (very strong evidence)'
    """
    judged = [c for c in candidates if c.bic is not None]
    chosen = candidates[0]
    if chosen.bic is None or len(judged) < 2:
        return "no other model was fitted to the same data"
    best = min(judged, key=lambda c: c.bic or 0.0)
    if chosen.bic < POSITIVE:
        rival = [c.model for c in judged if c is not chosen and c.bic is not None and c.bic < POSITIVE]
        tie = f"; {', '.join(rival)} cannot be told from it" if rival else ""
        return f"no model beside it explains these data better than {chosen.model} (BIC){tie}"
    degree = "very strong" if chosen.bic > VERY_STRONG else "strong" if chosen.bic > STRONG else "some"
    lower = f"BIC lower by {chosen.bic:.3g} ({degree} evidence)"
    return f"{best.model} explains these data better than {chosen.model}: {lower}"


def without(fit: ThrustFit, name: str) -> Remainder:
    """Fit again with the parameter `name` (a coefficient or `tare[recording]`) at zero. KeyError for another name."""
    if name not in fit.names:
        raise KeyError(f"without: no parameter {name!r}; there are {', '.join(fit.names)}")
    rows = fit.estimate.rows
    kept = [i for i, other in enumerate(rows.names) if other != name]
    names = tuple(rows.names[i] for i in kept)
    found = estimate(replace(rows, H=rows.H[:, kept], names=names), "wls" if fit.estimate.internal else "ls")
    judged, unit = found.underfit, np.eye(len(kept))
    stds = [found.spread(row).std for row in unit]
    return Remainder(
        name,
        float(np.sqrt(np.mean(found.fit.residual**2))),
        judged.per_dof if judged is not None and judged.dof > 0 else None,
        None if judged is None else judged.p_value,
        tuple((n, float(v), s) for n, v, s in zip(names, found.fit.theta, stds, strict=True)),
    )
