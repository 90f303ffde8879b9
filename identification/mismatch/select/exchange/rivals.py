"""Rivals: every other term that could do what one of the model does, refitted in its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.estimate import Estimate, fit_without
from identification.mismatch.estimate.fitting import Fit, change_of, fit
from identification.mismatch.model.data import Data, price
from identification.mismatch.select.exchange.nearby_start import best_forms, nearer
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.limits.clipping import contradiction
from identification.mismatch.select.screening import directions, refined
from identification.mismatch.select.stepwise import RivalTerm
from identification.physics.term import Term
from identification.recording import Floats

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
MOST_REFITS = 7
"""Rivals of one term that are refitted, the most alike first: each costs a fit."""


def one_for_two(
    estimate: Estimate, data: Data, terms: Sequence[Term], best: tuple[float, Fit] | None
) -> tuple[float, Fit] | None:
    """The better of `best` and one term in the place of two: a search that goes step by step may miss it."""
    now = estimate.fit
    logn = float(np.log(max(now.residual.size, 2)))
    for pair in combinations(now.model.terms, 2):
        less = fit_without(replace(estimate, fit=fit_without(estimate, pair[0], data)), pair[1], data)
        others = [t for t in terms if t.id not in {u.id for u in less.model.terms} and t not in pair]
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


def one_less(
    estimate: Estimate, data: Data, terms: Sequence[Term], best: tuple[float, Fit] | None
) -> tuple[float, Fit] | None:
    """The better of `best` and the model without one of its small terms, the others in their best forms: a term that
    came early may do no more than repair a form that is the wrong one because of it."""
    now = estimate.fit
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


def swaps(estimate: Estimate, term: Term, less: Fit, data: Data, terms: Sequence[Term]) -> list[RivalTerm[Term, Fit]]:
    """Every other term (and form) that could do what this one does, refitted in its place; best first."""
    now = estimate.fit
    gain = less.chi2 - now.chi2
    inside = {t.id for t in now.model.terms} - {term.id}
    others = [t for t in terms if t.id not in inside and t != term]
    found = directions(less, data, estimate.weights, others)
    if not found.terms:
        return []
    change = _effect(now, term, data, estimate)
    basis = orthogonal_basis(less.jacobian)
    change = change - basis @ (basis.T @ change)
    size = float(np.linalg.norm(change))
    if size == 0:
        return []
    rho = found.columns.T @ (change / size)
    against = (rho < 0) & ~np.array(found.one_sided)
    rho = np.where(found.one_sided, np.maximum(rho, 0.0), np.abs(rho))
    best: dict[Term, tuple[float, tuple[float, ...]]] = {}
    for j, other in enumerate(found.terms):
        if other not in best or rho[j] > best[other][0]:
            best[other] = (float(rho[j]), mirrored(other, found.values[j], data) if against[j] else found.values[j])
    best |= {other: (1.0, now.values[term]) for other in best if _same_limit(other, term, data)}
    ranked = sorted(best.items(), key=lambda item: -item[1][0])
    out = []
    extra_now = price(term, data)
    logn = float(np.log(max(now.residual.size, 2)))
    for other, (r, values) in ranked[:MOST_REFITS]:
        if (1 - r**2) * gain > policy.select.RIVAL_REFIT_CHI2 and r < policy.select.RIVAL_REFIT_LIKENESS:
            break
        more = price(other, data) - extra_now
        extra = more * logn
        hopeless = now.chi2 + policy.select.RIVAL_STATED_BIC - min(extra, 2.0 * more)
        new = _in_its_place(other, values, term, less, estimate, data, hopeless)
        if new.chi2 - now.chi2 + extra < max(FORMS_BEYOND * policy.select.RIVAL_STATED_BIC, FORMS_SHARE * gain):
            new = best_forms(new, [t for t in terms if t.id != other.id], data, estimate.weights, estimate.noise)
        if at_bound(other, new, data, estimate.weights) or contradiction(new, other, estimate.noise, data):
            continue
        loss = new.chi2 - now.chi2 + extra
        out.append(RivalTerm(other, new, float(loss), float(new.chi2 - now.chi2 + 2 * more)))
    return sorted(out, key=lambda rival: rival.bic_loss)


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
