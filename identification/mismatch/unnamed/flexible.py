"""A flexible term where no physics fits: a spline over the located covariate, so that the fit still improves.

Covariate, multiplier, knots and degree are chosen on a part of the data with the estimate's coloured noise; a term is
kept only when the rest of the data, which it has not seen, is predicted better. Then the terms are fitted to all rows,
their knots chosen anew.
Where a term of the catalogue fits but its name was not earned, the flexible term may take its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.flexible_terms.flexible import Flexible
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.locate.pulses import Pulses
from identification.mismatch.locate.residual_structure_test import residual_structure
from identification.mismatch.model.data import Data
from identification.mismatch.name.naming import Named
from identification.mismatch.unnamed.flexible_kinds import UNITS
from identification.mismatch.unnamed.flexible_knots import FlexibleCandidate, best_of, best_over
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.train_test_split import Judge, TrainTestSplit, better
from identification.physics.term import Term

MOST_COVARIATES = 3
"""Covariates tried for each term, the clearest first: each costs a search for knots."""
FOLLOW_LOAD = ("bus_voltage", "current", "torque", "load_history")
"""Quantities that a thruster's own load moves."""
FIT_STEPS = 10
"""Steps of the fit with a new term: its values begin at the linear solution."""


@dataclass(frozen=True, eq=False)
class Extended:
    """A model with flexible terms, on all rows."""

    estimate: Estimate
    terms: tuple[Flexible, ...]
    """In the order in which they were found."""
    dropped: tuple[Term, ...]
    """Terms of the model before whose place they take."""
    without: float
    """Held-out RMSE of the model before, N."""
    held: float
    """Held-out RMSE with them, N."""
    equals: tuple[str, ...]
    """Coordinates over which the first of them would have done about as well."""


def extend(
    after: Estimate,
    before: Estimate,
    data: Data,
    located: str,
    unearned: Sequence[Named],
    split: TrainTestSplit,
    rng: np.random.Generator,
) -> Extended | None:
    """The model with up to FLEXIBLE_TERMS flexible terms; None where none improves what was not fitted.

    None also where they predict it worse than the baseline, `before`, or than the names alone.

    `located`: the covariate over which it is left; `unearned`: terms whose name was not earned; `split`: `after`,
    fitted to a part of the data.
    """
    part, judge, begin = split.data, split.judge, split.estimate
    first = judge(begin.fit)
    bases = _bases(begin, part, [n.term for n in unearned])
    plain = fit(before.fit.model, before.fit.theta, part, begin.weights)
    least = min(judge(each).rmse for each in (plain, *(base.fit for base in bases)))
    for smaller in bases:
        estimate, terms, held, equals = _grown(smaller, part, located, judge, rng)
        improves = better(held, first, 0) or (
            smaller is not begin and held.rmse < policy.unnamed.SHAPE_INSTEAD_OF_NAMES_RMSE * first.rmse
        )
        if terms and improves and held.rmse < least:
            break
    else:
        return None
    whole = refresh(estimate.fit.model, replace(estimate.fit.theta, tares=after.fit.theta.tares), data, None, None)
    whole, final = _anew(whole, terms, data)
    dropped = tuple(t for t in after.fit.model.terms if t not in estimate.fit.model.terms)
    return Extended(whole, tuple(final), dropped, first.rmse, held.rmse, equals)


def foremost(estimate: Estimate, data: Data, order: Sequence[str], pulses: Pulses | None) -> str:
    """The covariate, of those in `order`, over which a flexible term gains most; the first when none gains."""
    tried = [best_over(quantity, estimate, data, pulses) for quantity in order[:MOST_COVARIATES]]
    found = [c for c in tried if c is not None]
    best = max(found, key=lambda c: c.gain, default=None)
    return order[0] if best is None or best.gain <= 0 else best.term.quantity


def _anew(whole: Estimate, terms: Sequence[Flexible], data: Data) -> tuple[Estimate, list[Flexible]]:
    """Knots chosen again with all rows, one term after the other."""
    final = []
    for term in terms:
        less = replace(whole, fit=fit(*whole.fit.less(term), data, whole.weights))
        found = best_of([term], less, data)
        if found is None or found.term == term:
            final.append(term)
            continue
        whole = _joined(less, data, found)
        final.append(found.term)
    return whole, final


def _bases(begin: Estimate, part: Data, unearned: Sequence[Term]) -> list[Estimate]:
    """The model without what was unearned, and as it is."""
    if not unearned:
        return [begin]
    less = fit(*begin.fit.less(*unearned), part, begin.weights)
    return [replace(begin, fit=less), begin]


def _grown(
    estimate: Estimate, part: Data, located: str, judge: Judge, rng: np.random.Generator
) -> tuple[Estimate, list[Flexible], Score, tuple[str, ...]]:
    """Terms one after another while each predicts better what was not fitted; and the first one's equals."""
    terms: list[Flexible] = []
    equals: tuple[str, ...] = ()
    held = judge(estimate.fit)
    left, pulses = _left(estimate, part, rng)
    order = list(dict.fromkeys((located, *left)))
    while True:
        taken = {t.quantity for t in terms}
        new = None
        candidates = _candidates(estimate, part, [q for q in order if q not in taken], pulses)
        for candidate in candidates:
            tried, term = _added(estimate, part, candidate)
            score = judge(tried.fit)
            if better(score, held, len(term.parameters(part.scale))):
                new, held = tried, score
                equals = equals if terms else _equals(candidate, candidates)
                terms.append(term)
                break
        if new is None:
            return estimate, terms, held, equals
        estimate = new
        if len(terms) == policy.unnamed.FLEXIBLE_TERMS:
            return estimate, terms, held, equals
        order, pulses = _left(estimate, part, rng)


def _left(estimate: Estimate, part: Data, rng: np.random.Generator) -> tuple[list[str], Pulses | None]:
    """Coordinates over which something is left, the clearest first, and pulses that come back."""
    left = residual_structure(estimate.fit, part, estimate.weights, rng)
    clear = [g.covariate.quantity for g in left.groups if g.p_value < policy.locate.RESIDUAL_FALSE_ALARM]
    return (clear, left.pulses) if left.p_value < policy.locate.RESIDUAL_FALSE_ALARM else ([], None)


def _candidates(estimate: Estimate, part: Data, order: Sequence[str], pulses: Pulses | None) -> list[FlexibleCandidate]:
    """The best over each of the first covariates; the located one first unless others gain more, or a recorded
    quantity gains as much: what a channel does, time can do too. A quantity that never turns back is time by another
    name, and time claims less. Where a quantity that follows the load is best, the static curve itself goes before it
    when it gains nearly as much."""
    found = [best_over(quantity, estimate, part, pulses) for quantity in order[:MOST_COVARIATES]]
    gaining = [c for c in found if c is not None and c.gain > 0]
    if not gaining:
        return []
    most = max(c.gain for c in gaining)
    equal = {c.term.quantity for c in gaining if c.gain > most - policy.unnamed.COVARIATES_EQUAL_BIC}
    rising = {q for q in equal if q in UNITS and _with_time(q, part)}
    first = "time" if "time" in equal and order[0] in rising else order[0]
    follows = max(gaining, key=lambda c: c.gain).term.quantity in FOLLOW_LOAD
    static = (part.histories[0].driver_quantity, "direction")

    def rank(c: FlexibleCandidate) -> tuple[bool, bool, bool, float]:
        near = c.gain > policy.unnamed.LOCATED_GAIN * most
        itself = follows and near and c.term.quantity in static
        recorded = c.term.quantity in equal - rising and c.term.quantity in UNITS
        return not itself, not recorded, c.term.quantity != first or not near, -c.gain

    return sorted(gaining, key=rank)


def _with_time(quantity: str, data: Data) -> bool:
    """Whether a recorded quantity rises or falls all through each run, but for its noise: Spearman's correlation."""
    order = [
        np.corrcoef(np.argsort(np.argsort(h.others[quantity][r])), np.arange(r.size))[0, 1]
        for h, r in zip(data.histories, data.rows, strict=True)
    ]
    return bool(np.min(np.abs(order)) > policy.unnamed.MONOTONE_CORRELATION)


def _equals(chosen: FlexibleCandidate, candidates: Sequence[FlexibleCandidate]) -> tuple[str, ...]:
    """Coordinates of the others that gain about as much."""
    return tuple(
        c.term.quantity
        for c in candidates
        if c is not chosen and c.gain > chosen.gain - policy.unnamed.COVARIATES_EQUAL_BIC
    )


def _added(estimate: Estimate, part: Data, candidate: FlexibleCandidate) -> tuple[Estimate, Flexible]:
    """The model with the term, its noise estimated anew, and the knots chosen again with that noise."""
    first = _joined(estimate, part, candidate)
    first = refresh(first.fit.model, first.fit.theta, part, None, replace(first, rows=part.thrust_rows))
    less = fit(estimate.fit.model, estimate.fit.theta, part, first.weights)
    again = best_of([candidate.term], replace(first, fit=less), part)
    if again is None or again.term == candidate.term:
        return first, candidate.term
    second = _joined(replace(first, fit=less), part, again)
    return (second, again.term) if second.bic < first.bic else (first, candidate.term)


def _joined(estimate: Estimate, part: Data, candidate: FlexibleCandidate) -> Estimate:
    bigger, theta = estimate.fit.more(candidate.term, candidate.start)
    return replace(estimate, fit=fit(bigger, theta, part, estimate.weights, FIT_STEPS))
