"""How like another term is to what one of the model does, by its tangent beside the rest of the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit, change_of
from identification.mismatch.model.data import Data
from identification.mismatch.select.exchange.nearby_start import beginnings, may_replace
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.screening import directions
from identification.physics.term import Term
from identification.recording import Floats

Alike = dict[Term, tuple[float, tuple[float, ...]]]
"""Of each other term and form its correlation with what the term does, and the trial values that have it."""


def worth_refitting(like: float, gain: float) -> bool:
    """Whether a rival of a likeness may do what is worth `gain` of chi-square."""
    return (1 - like**2) * gain <= policy.select.RIVAL_REFIT_CHI2 or like >= policy.select.RIVAL_REFIT_LIKENESS


def alike(estimate: Estimate, term: Term, less: Fit, data: Data, terms: Sequence[Term]) -> Alike:
    """Every other term (and form) beside the model without `term`, which is `less`; once for all who ask."""

    def made() -> Alike:
        return _alike(estimate, term, less, data, terms)

    found: Alike = data.predictor.once(("alike", term), made, estimate, less, data, terms)
    return found


def _alike(estimate: Estimate, term: Term, less: Fit, data: Data, terms: Sequence[Term]) -> Alike:
    now = estimate.fit
    inside = {t.id for t in now.model.terms} - {term.id}
    others = [t for t in terms if t.id not in inside and t != term and may_replace(term, t, now.model)]
    found = directions(less, data, estimate.weights, others)
    change = _effect(now, term, data, estimate)
    basis = orthogonal_basis(less.jacobian)
    change = change - basis @ (basis.T @ change)
    size = float(np.linalg.norm(change))
    if size == 0:
        return {}
    rho = found.columns.T @ (change / size)
    against = (rho < 0) & ~np.array(found.one_sided, dtype=bool)
    rho = np.where(found.one_sided, np.maximum(rho, 0.0), np.abs(rho))
    best: Alike = {}
    for j, other in enumerate(found.terms):
        if other not in best or rho[j] > best[other][0]:
            best[other] = (float(rho[j]), mirrored(other, found.values[j], data) if against[j] else found.values[j])
    closer = {t: beginnings(term, now.values[term], t, data.scale)[0] for t in best if t.traits.closer}
    limits = {other: now.values[term] for other in best if _same_limit(other, term, data)}
    return best | {other: (1.0, values) for other, values in (closer | limits).items()}


def _same_limit(other: Term, term: Term, data: Data) -> bool:
    """Whether it is the same limit in another form: it begins where this one is, for trials at other limits change
    other readings and look like nothing of it."""
    names = [[p.name for p in each.parameters(data.scale)] for each in (other, term)]
    return bool(term.traits.limits) and other.id == term.id and names[0] == names[1]


def mirrored(term: Term, values: tuple[float, ...], data: Data) -> tuple[float, ...]:
    """The amount on the other side of neutral."""
    first = term.parameters(data.scale)[0]
    assert first.neutral is not None
    return (min(max(2 * first.neutral - values[0], first.low), first.high), *values[1:])


def _effect(now: Fit, term: Term, data: Data, estimate: Estimate) -> Floats:
    """(n,) whitened change that the term makes at its fitted values; the rate's rows with it."""
    return estimate.weights.whiten(*change_of(now.less(term), (now.model, now.theta), data, estimate.weights))
