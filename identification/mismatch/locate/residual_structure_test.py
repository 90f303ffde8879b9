"""What no term carries: structure of any shape in what is left, over each thing that was recorded.

Each covariate (covariates.py) has a group of columns. The size of the whitened residual in the span of a group is
chi-square distributed when nothing is left. The smallest p-value of all groups is judged against its own distribution
under drawn signs of blocks, as the screening is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.tails import chi2_sf, noncentral_chi2_sf
from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.locate.pulses import Pulses, likeliest_pulses
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.covariates import Covariate, covariates
from identification.mismatch.select.family_wise import beside, family_p_value, orthogonal_basis
from identification.mismatch.select.likeliest_trials import TRIED, jumps
from identification.mismatch.select.shape_error import allowed_in, corrections, of_twin
from identification.recording import Floats


@dataclass(frozen=True, eq=False)
class CovariateTest:
    """One covariate's group of columns against the residual."""

    covariate: Covariate
    statistic: float
    dof: int
    p_value: float
    """Of this group alone, shape error of the model's terms allowed for."""
    share: float
    """Of the residual's (whitened) sum of squares beyond what noise has."""


@dataclass(frozen=True, eq=False)
class ResidualStructure:
    """What a model leaves over each covariate, and whether any of it is more than noise."""

    groups: tuple[CovariateTest, ...]
    """Smallest p-value first."""
    p_value: float
    """Family-wise, of the smallest."""
    pulses: Pulses | None = None
    """Of the gain, that come back: a part of what is left over time."""


def residual_structure(
    fit: Fit,
    data: Data,
    weights: Weights,
    rng: np.random.Generator,
    looked_at: Sequence[Covariate] | None = None,
    *,
    pulsing: bool = True,
) -> ResidualStructure:
    """Judge the residual of the thrust over every covariate. `pulsing`: pulses that come back are looked for too."""
    found = tuple(looked_at) if looked_at is not None else covariates(fit, data)
    n = data.size
    residual = np.clip(fit.residual[:n], -policy.locate.OUTLIER_SIGMA, policy.locate.OUTLIER_SIGMA)
    left = _Left(fit, data, weights, residual, orthogonal_basis(fit.jacobian[:n]))
    changes = [*corrections(fit, data, Weights(weights.thrust)), *of_twin(fit, data, Weights(weights.thrust))]
    tried = [each for c in found if (each := _tried(c, left, changes)) is not None]
    if not tried:
        return ResidualStructure((), 1.0)
    groups, spans = [group for group, _ in tried], [span for _, span in tried]
    pulses = _beside_others(left, groups, spans) if pulsing else None
    if pulses is not None:
        groups = [_or_pulses(g, pulses, residual) for g in groups]
    p_family = family_p_value([g.p_value for g in groups], spans, residual, rng)
    ordered = sorted(groups, key=lambda g: (g.p_value, g.dof - g.statistic))
    return ResidualStructure(tuple(ordered), p_family, pulses)


@dataclass(frozen=True, eq=False, slots=True)
class _Left:
    """What a fit leaves, in sigma."""

    fit: Fit
    data: Data
    weights: Weights
    residual: Floats
    """(n,) Of the thrust, without outliers."""
    basis: Floats
    """(n, p) Orthonormal, of what the model's parameters can follow."""


def _tried(c: Covariate, left: _Left, changes: list[Floats]) -> tuple[CovariateTest, Floats] | None:
    """The test of a covariate and the span (n, k) of its columns; None where the model follows all of them."""
    weights, residual = left.weights, left.residual
    span = orthogonal_basis(beside(Weights(weights.thrust).whiten(list(c.columns), []), left.basis))
    if span.shape[1] == 0:
        return None
    score = span.T @ residual
    stat, dof = float(score @ score), span.shape[1]
    if weights.ticks and c.quantity == "time_since_step":
        ticks = left.fit.residual[left.fit.residual.size - sum(rows.target.size for rows in left.data.ticks) :]
        stat, dof = stat + float(ticks @ ticks), dof + ticks.size
    p = _tail(stat, dof, allowed_in(changes, span))
    found = CovariateTest(c, stat, dof, p, max(stat - dof, 0.0) / max(float(residual @ residual), 1e-300))
    if c.quantity == "time":
        jump = _jump(c, left.fit, residual, left.data, weights, left.basis)
        found = min(found, jump, key=lambda each: each.p_value)
    return found, span


def _beside_others(left: _Left, groups: Sequence[CovariateTest], spans: Sequence[Floats]) -> Pulses | None:
    """Pulses over time, beside what is plainly left over the other covariates; None where time is none of them."""
    if all(g.covariate.quantity != "time" for g in groups):
        return None
    others = [
        (span, g)
        for span, g in zip(spans, groups, strict=True)
        if g.covariate.quantity != "time" and g.p_value < policy.locate.PLAIN_STRUCTURE_P
    ]
    return _pulses(left.fit, left.residual, left.data, left.weights, others)


def _or_pulses(group: CovariateTest, pulses: Pulses, residual: Floats) -> CovariateTest:
    if group.covariate.quantity != "time":
        return group
    return min(group, _of_pulses(group.covariate, pulses, residual), key=lambda g: g.p_value)


def _jump(time: Covariate, fit: Fit, residual: Floats, data: Data, weights: Weights, basis: Floats) -> CovariateTest:
    """The likeliest jump of the zero: under slow noise it shows for seconds only, and no smooth shape follows it.

    Taken for one only where it is plainly no noise.
    """
    when, score = jumps(residual, data, weights, basis)
    known = [
        value
        for term, values in fit.values.items()
        for p, value in zip(term.parameters(data.scale), values, strict=True)
        if p.name == term.traits.instant
    ]
    new = np.all([np.abs(when - at) > policy.select.JUMPS_APART * data.scale.duration for at in known], axis=0)
    when, score = (when[new], score[new]) if known else (when, score)
    if not score.size:
        return CovariateTest(time, 0.0, 1, 1.0, 0.0)
    stat = float(score[0] ** 2)
    p = TRIED * _tail(stat, 1, 0.0)
    told = replace(time, what=f"{time.what}; the reading jumps at {when[0]:.4g} s")
    share = max(stat - 1, 0.0) / max(float(residual @ residual), 1e-300)
    return CovariateTest(told, stat, 1, p if p < policy.locate.PLAIN_STRUCTURE_P else 1.0, share)


def _pulses(
    fit: Fit, residual: Floats, data: Data, weights: Weights, others: Sequence[tuple[Floats, CovariateTest]]
) -> Pulses | None:
    """The likeliest pulses of the gain that come back: slow noise takes them up, and no smooth shape follows them.

    Taken for such only where they are plainly no noise, and account for what is plainly left over `others` (spans), but
    not these for them: a plan that repeats itself makes pulses of anything.
    """
    found = likeliest_pulses(fit, data, weights, residual)
    if found is None or found.p_value > policy.locate.PLAIN_STRUCTURE_P:
        return None
    rest = residual - found.column * (found.column @ residual)
    if any(_tail(float(np.sum((Q.T @ rest) ** 2)), g.dof, 0.0) < policy.locate.PLAIN_STRUCTURE_P for Q, g in others):
        return None
    if others:
        known = orthogonal_basis(np.column_stack([Q for Q, _ in others]))
        beyond = likeliest_pulses(fit, data, weights, residual - known @ (known.T @ residual))
        if beyond is None or beyond.p_value > policy.locate.PLAIN_STRUCTURE_P:
            return None
    return found


def _of_pulses(time: Covariate, found: Pulses, residual: Floats) -> CovariateTest:
    stat = found.sigmas**2
    share = max(stat - 1, 0.0) / max(float(residual @ residual), 1e-300)
    return CovariateTest(replace(time, what=f"{time.what}; {found.statement}"), stat, 1, found.p_value, share)


def _tail(stat: float, dof: int, extra: float) -> float:
    p = float(noncentral_chi2_sf(stat, dof, extra)) if extra > 1e-9 else float(chi2_sf(stat, dof))
    return p if np.isfinite(p) else 0.0
