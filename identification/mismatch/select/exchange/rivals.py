"""Rivals: every other term that could do what one of the model does, refitted in its place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from types import MappingProxyType

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.estimate import Estimate, fit_without
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.data import Data, price
from identification.mismatch.select.exchange.likeness import alike, mirrored, worth_refitting
from identification.mismatch.select.exchange.nearby_start import best_forms, nearer
from identification.mismatch.select.limits.clipping import contradiction
from identification.mismatch.select.screening import directions, refined
from identification.mismatch.select.stepwise import RivalTerm, Standing
from identification.physics.term import Term

MOST_MERGERS = 3
"""Terms tried in the place of each pair."""
RIVAL_STEPS = 15
"""Steps of the fit of a rival: what is not near by then is no rival."""
FORMS_BEYOND = 5.0
"""Times what is stated: a rival that loses so much may do as well with the other terms in other forms."""
FORMS_SHARE = 1e-3
"""Of what the term gains: a rival that loses no more does the same, and the rest may be a form that suits the term."""
SMALL_TERM = 0.05
"""Of what the largest term gains: one that gains less may be a repair."""
FIRST_LIKENESS = 0.7
"""From which the rival that is most alike of all is refitted in any case: of a few trials none need be near."""
MOST_REFITS = 7
"""Rivals of one term that are refitted, the most alike first: each costs a fit."""


def one_for_two(
    estimate: Estimate,
    data: Data,
    terms: Sequence[Term],
    standing: Mapping[Term, Standing[Fit, Term]],
    best: tuple[float, Fit] | None,
) -> tuple[float, Fit] | None:
    """The better of `best` and one term in the place of two: a search that goes step by step may miss it."""
    now = estimate.fit
    logn = float(np.log(max(now.residual.size, 2)))
    for pair in combinations(now.model.terms, 2):
        others = [t for t in terms if _for_both(t, pair, estimate, data, terms, standing)]
        if not others:
            continue
        less = fit_without(replace(estimate, fit=fit_without(estimate, pair[0], data)), pair[1], data)
        found = directions(less, data, estimate.weights, others)
        score = found.columns.T @ less.residual
        tried: set[Term] = set()
        for j in np.argsort(-np.where(found.one_sided, score, np.abs(score))):
            other = found.terms[j]
            if other in tried:
                continue
            more = (price(other, data) - sum(price(t, data) for t in pair)) * logn
            wanted = (
                now.chi2
                - more
                + (-policy.select.RIVAL_BETTER_BIC if best is None else min(best[0], -policy.select.RIVAL_BETTER_BIC))
            )
            if len(tried) == MOST_MERGERS or score[j] ** 2 < policy.select.MERGER_PROMISE * (less.chi2 - wanted):
                break
            tried.add(other)
            values = mirrored(other, found.values[j], data) if score[j] < 0 else found.values[j]
            begin = refined(less, data, estimate.weights, other, values)
            bigger, theta = less.more(other, begin)
            new = fit(bigger, theta, data, estimate.weights, RIVAL_STEPS, wanted, near=less)
            loss = new.chi2 - now.chi2 + more
            if (
                loss < -policy.select.RIVAL_BETTER_BIC
                and (best is None or loss < best[0])
                and not at_bound(other, new, data, estimate.weights)
            ):
                best = (float(loss), new)
    return best


def _for_both(
    other: Term,
    pair: tuple[Term, Term],
    estimate: Estimate,
    data: Data,
    terms: Sequence[Term],
    standing: Mapping[Term, Standing[Fit, Term]],
) -> bool:
    """Whether `other` may do what both do: then it does as well in the place of each, beside the other of them."""
    now = estimate.fit
    if other in pair or other.id in {t.id for t in now.model.terms if t not in pair}:
        return False
    logn = float(np.log(max(now.residual.size, 2)))
    most = (sum(price(t, data) for t in pair) - price(other, data)) * logn + policy.select.RIVAL_STATED_BIC
    for term in pair:
        less, rivals = standing[term]
        if other.id == term.id:
            if not any(r.term == other and r.fit.chi2 - now.chi2 < most for r in rivals):
                return False
        elif other.id not in {t.id for t in pair}:
            like, _ = alike(estimate, term, less, data, terms).get(other, (0.0, ()))
            if not worth_refitting(like, less.chi2 - now.chi2):
                return False
    return True


def one_less(estimate: Estimate, data: Data, terms: Sequence[Term]) -> tuple[float, Fit] | None:
    """The model without one of its small terms, the others in their best forms: a term that came early may do no more
    than repair a form that is the wrong one because of it. None where none is better."""
    now = estimate.fit
    best: tuple[float, Fit] | None = None
    less = {term: fit_without(estimate, term, data) for term in now.model.terms}
    most = max(each.chi2 for each in less.values()) - now.chi2
    logn = float(np.log(max(now.residual.size, 2)))
    for term, without in less.items():
        if without.chi2 - now.chi2 > SMALL_TERM * most:
            continue
        new = best_forms(without, terms, data, estimate.weights, estimate.noise)
        loss = new.chi2 - now.chi2 - price(term, data) * logn
        if new is not without and loss < -policy.select.RIVAL_BETTER_BIC and (best is None or loss < best[0]):
            best = (float(loss), new)
    return best


def swaps(
    estimate: Estimate,
    term: Term,
    less: Fit,
    data: Data,
    terms: Sequence[Term],
    stood: Mapping[Term, tuple[float, ...]] = MappingProxyType({}),
) -> list[RivalTerm[Term, Fit]]:
    """Every other term (and form) that could do what this one does, refitted in its place; best first. One that `stood`
    there and was exchanged for it begins where it was: its trials need be like neither."""
    now = estimate.fit
    gain = less.chi2 - now.chi2
    inside = {t.id for t in now.model.terms} - {term.id}
    before = {t: (1.0, values) for t, values in stood.items() if t != term and t.id not in inside}
    ranked = sorted((alike(estimate, term, less, data, terms) | before).items(), key=lambda item: -item[1][0])
    out = []
    extra_now = price(term, data)
    logn = float(np.log(max(now.residual.size, 2)))
    for rank, (other, (r, values)) in enumerate(ranked[:MOST_REFITS]):
        if not worth_refitting(r, gain) and (rank > 0 or r < FIRST_LIKENESS):
            break
        more = price(other, data) - extra_now
        extra = more * logn
        moved = constant_moved(now, data)
        hopeless = policy.select.RIVAL_STATED_BIC - min(extra, 2.0 * more) + moved
        suited = max(FORMS_BEYOND * policy.select.RIVAL_STATED_BIC, FORMS_SHARE * gain)
        new = _in_its_place(other, values, term, less, estimate, data, now.chi2 + max(hopeless, FORMS_SHARE * gain))
        if new.chi2 - now.chi2 + extra < suited:
            new = best_forms(new, [t for t in terms if t.id != other.id], data, estimate.weights, estimate.noise)
        if new.chi2 - now.chi2 + constant_moved(new, data) - moved + extra < policy.select.RIVAL_STATED_BIC:
            new = fit(new.model, new.theta, data, estimate.weights, near=new)  # it counts by how well it can do
        if at_bound(other, new, data, estimate.weights) or contradiction(new, other, estimate.noise, data):
            continue
        loss = new.chi2 - now.chi2 + constant_moved(new, data) - moved
        out.append(RivalTerm(other, new, float(loss + extra), float(loss + 2 * more)))
    return sorted(out, key=lambda rival: rival.bic_loss)


def constant_moved(fitted: Fit, data: Data) -> float:
    """What a model costs in which C is not that of the twin: as much as its chi-square would rise if C had to be, at
    most a parameter more. 0 without a twin, and where a term says what C refers to."""
    if data.constant_before is None or any(term.traits.refers for term in fitted.model.terms):
        return 0.0
    before, unsure = data.constant_before
    both = float(np.hypot(fitted.std[0], unsure))
    price = float(np.log(max(fitted.residual.size, 2)))
    return min(((fitted.theta.C - before) / both) ** 2, price) if both > 0 else 0.0


def _in_its_place(
    other: Term,
    values: tuple[float, ...],
    term: Term,
    less: Fit,
    estimate: Estimate,
    data: Data,
    hopeless: float,
) -> Fit:
    """The model with `other`, begun at a trial's `values`, where `term` was; `less` is without either."""
    now, weights = estimate.fit, estimate.weights
    begin = refined(less, data, weights, other, values)
    bigger, begun = nearer(less, now, term, other, begin, data, weights)
    if other.id == term.id:  # the same physics in another form: it is worth more steps, however slow they are
        return fit(bigger, begun, data, weights, near=now)
    return fit(bigger, begun, data, weights, RIVAL_STEPS, hopeless, near=now)
