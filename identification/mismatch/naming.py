"""A name is earned: no rival does as well, the parameter is the same everywhere, and its value is possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from identification.mismatch.fitting import Fit, at_bound, extended, fit, raw
from identification.mismatch.model import Data, Weights, predict, price
from identification.mismatch.omnibus import Omnibus
from identification.mismatch.preparing import DRIVERS
from identification.mismatch.screening import directions, orthogonal_basis, refined
from identification.mismatch.search import STATIC, State, refresh
from identification.physics.term import Term
from identification.recording import Floats
from identification.tails import chi2_sf, noncentral_chi2_sf

NEAR = 9.0
"""BIC units: a rival this near is stated."""
EQUAL = 4.0
"""BIC units: nearer than this two answers are equally good."""
LIKELY = 40.0
"""Chi-square that a rival may lose by the tangent alone and is still refitted: its inner parameters may move."""
PRESSED_SHARE = 0.3
"""Of its gain: a rival may be worse by this than a term whose parameters end at what is possible."""
MOST_MERGERS = 3
"""Terms tried in the place of each pair."""
RIVAL_STEPS = 15
MOST_REFITS = 7
SAME = 0.1
"""Parts of a run whose parameters differ by less count as the same."""
OWN_SHARE = 0.01
"""Of what a term explains: less than this left over its own coordinate is the textbook's fault, not the name's."""
INCONSTANT = 1e-3
"""p-value, after all tests of a term, below which its parameter is not the same everywhere."""
BETTER = 0.5
"""BIC units by which a rival must be better to take the place."""
OWN_COORDINATE = 1e-4
"""p-value of what is left over a term's own coordinate below which its name is not earned."""
MANY_SHAPES = 3
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Rival:
    """Another term in the place of one, refitted."""

    term: Term
    fit: Fit
    bic_loss: float
    """By how much its BIC is worse."""
    aic_loss: float
    """By how much its AIC is worse: BIC alone would hide a rival with more parameters than the data can tell apart."""


Standing = tuple[Fit, list[Rival]]
"""The fit without a term, and the rivals in its place."""


@dataclass(frozen=True, eq=False)
class Named:
    """One term of the final model and what speaks for its name."""

    term: Term
    theta: tuple[float, ...]
    std: tuple[float, ...]
    chi2_gain: float
    bic_gain: float
    p_value: float
    probability: float
    rivals: tuple[Rival, ...]
    """Other effects within NEAR, best first."""
    doubts: tuple[str, ...]
    """Why the name is not earned; empty when it is."""


def without(state: State, term: Term, data: Data) -> Fit:
    """The model without one term, refitted with the same noise."""
    smaller = state.fit.model.without(term)
    known = dict(zip(state.fit.model.terms, state.fit.theta.terms, strict=True))
    theta = replace(state.fit.theta, terms=tuple(known[t] for t in smaller.terms))
    return fit(smaller, theta, data, state.weights)


def settle_forms(state: State, data: Data, terms: Sequence[Term]) -> tuple[State, dict[Term, Standing] | None]:
    """Exchange a term for a rival wherever that makes the BIC smaller; and how each term stands in the end."""
    for _ in range(ROUNDS):
        best: tuple[float, Fit] | None = None
        standing: dict[Term, Standing] = {}
        for term in state.fit.model.terms:
            less = without(state, term, data)
            standing[term] = (less, swaps(state, term, less, data, terms))
            # a value that is not possible explains nothing: whatever does nearly as well goes before it
            price = 0.0
            if at_bound(term, state.fit, data, state.weights):
                price = PRESSED_SHARE * (less.chi2 - state.fit.chi2)
            for rival in standing[term][1]:
                loss = rival.bic_loss - price
                if loss < -BETTER and (best is None or loss < best[0]):
                    best = (loss, rival.fit)
        best = _one_for_two(state, data, terms, best)
        if best is None:
            return state, standing
        state = refresh(best[1].model, best[1].theta, data, None, state)
    return state, None


def _one_for_two(
    state: State, data: Data, terms: Sequence[Term], best: tuple[float, Fit] | None
) -> tuple[float, Fit] | None:
    """The better of `best` and one term in the place of two: a search that goes step by step may miss it."""
    now = state.fit
    logn = float(np.log(max(now.residual.size, 2)))
    for pair in combinations(now.model.terms, 2):
        less = now
        for term in pair:
            less = without(replace(state, fit=less), term, data)
        others = [t for t in terms if t.id not in {u.id for u in less.model.terms} and t not in pair]
        found = directions(less, data, state.weights, others)
        score = found.columns.T @ less.residual
        tried: set[Term] = set()
        for j in np.argsort(-np.where(found.one_sided, score, np.abs(score))):
            other = found.terms[j]
            if other in tried:
                continue
            if len(tried) == MOST_MERGERS:
                break
            tried.add(other)
            values = mirrored(other, found.values[j], data) if score[j] < 0 else found.values[j]
            bigger = less.model.plus(other)
            begin = refined(less, data, state.weights, other, values)
            new = fit(bigger, extended(less.theta, less.model, other, begin, bigger), data, state.weights, RIVAL_STEPS)
            loss = new.chi2 - now.chi2 + (price(other, data) - sum(price(t, data) for t in pair)) * logn
            if loss < -BETTER and (best is None or loss < best[0]) and not at_bound(other, new, data, state.weights):
                best = (float(loss), new)
    return best


def swaps(state: State, term: Term, less: Fit, data: Data, terms: Sequence[Term]) -> list[Rival]:
    """Every other term (and form) that could do what this one does, refitted in its place; best first."""
    now = state.fit
    gain = less.chi2 - now.chi2
    inside = {t.id for t in now.model.terms} - {term.id}
    others = [t for t in terms if t.id not in inside and t != term]
    found = directions(less, data, state.weights, others)
    if not found.terms:
        return []
    change = _effect(now, term, data, state)
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
    ranked = sorted(best.items(), key=lambda item: -item[1][0])
    out = []
    extra_now = price(term, data)
    logn = float(np.log(max(now.residual.size, 2)))
    for other, (r, values) in ranked[:MOST_REFITS]:
        if (1 - r**2) * gain > LIKELY and r < 0.9:
            break
        bigger = less.model.plus(other)
        begin = refined(less, data, state.weights, other, values)
        more = price(other, data) - extra_now
        extra = more * logn
        begun = extended(less.theta, less.model, other, begin, bigger)
        new = fit(bigger, begun, data, state.weights, RIVAL_STEPS, now.chi2 + NEAR - min(extra, 2.0 * more))
        if at_bound(other, new, data, state.weights):
            continue
        loss = new.chi2 - now.chi2 + extra
        out.append(Rival(other, new, float(loss), float(new.chi2 - now.chi2 + 2 * more)))
    return sorted(out, key=lambda rival: rival.bic_loss)


def mirrored(term: Term, values: tuple[float, ...], data: Data) -> tuple[float, ...]:
    """The amount on the other side of neutral."""
    first = term.parameters(data.scale)[0]
    assert first.neutral is not None
    return (min(max(2 * first.neutral - values[0], first.low), first.high), *values[1:])


def _effect(now: Fit, term: Term, data: Data, state: State) -> Floats:
    """(n,) whitened change that the term makes at its fitted values; the rate's rows with it."""
    with_rate = bool(state.weights.rate)
    smaller = now.model.without(term)
    known = dict(zip(now.model.terms, now.theta.terms, strict=True))
    theta = replace(now.theta, terms=tuple(known[t] for t in smaller.terms))
    full, full_rate = raw(now.model, now.theta, data, with_rate=with_rate)
    less, less_rate = raw(smaller, theta, data, with_rate=with_rate)
    return state.weights.whiten(
        [a - b for a, b in zip(full, less, strict=True)], [a - b for a, b in zip(full_rate, less_rate, strict=True)]
    )


def doubts(state: State, term: Term, data: Data, many: int) -> tuple[str, ...]:
    """Where the parameter of a term is not the same: halves of the run, directions, levels, runs."""
    out = []
    if at_bound(term, state.fit, data, state.weights):
        out.append("its parameters end at what is physically possible")
    change = _raw_effect(state.fit, term, data)
    n = data.size
    basis = orthogonal_basis(state.fit.jacobian[:n])
    driver = [h.driver[r] for h, r in zip(data.histories, data.rows, strict=True)]
    middle = [h.middle[r] for h, r in zip(data.histories, data.rows, strict=True)]
    half = np.median(np.abs(np.concatenate(driver)))
    splits = {
        "in both halves of the run": [t > np.median(t) for t in middle],
        "in both directions": [v < 0 for v in driver],
        "at all levels": [np.abs(v) > half for v in driver],
    }
    if len(driver) > 1:
        splits["in all runs"] = [np.full(v.size, i >= len(driver) / 2) for i, v in enumerate(driver)]
    weights = Weights(state.weights.thrust)
    for what, masks in splits.items():
        column = weights.whiten([c * m for c, m in zip(change, masks, strict=True)], [])
        rest = column - basis @ (basis.T @ column)
        size = float(np.linalg.norm(rest))
        if size < 1e-3 * float(np.linalg.norm(column)) or size < 0.3:
            continue
        score = float(rest @ state.fit.residual[:n]) / size
        p = float(noncentral_chi2_sf(score**2, 1, (SAME * size) ** 2))
        if p * len(splits) * many < INCONSTANT:
            out.append(f"its parameter is not the same {what} ({abs(score) / size * 100:.0f} % apart)")
    return tuple(out)


def _raw_effect(now: Fit, term: Term, data: Data) -> list[Floats]:
    smaller = now.model.without(term)
    known = dict(zip(now.model.terms, now.theta.terms, strict=True))
    theta = replace(now.theta, terms=tuple(known[t] for t in smaller.terms))
    out = []
    for i, (h, r) in enumerate(zip(data.histories, data.rows, strict=True)):
        full, _ = predict(now.model, now.theta, h, data.scale, i)
        less, _ = predict(smaller, theta, h, data.scale, i)
        out.append((full - less)[r])
    return out


def name(
    state: State, data: Data, terms: Sequence[Term], standing: dict[Term, Standing] | None = None
) -> tuple[Named, ...]:
    """Every term of the model with its rivals and doubts, the largest gain first."""
    out = []
    logn = float(np.log(max(state.fit.residual.size, 2)))
    at = 1
    std = state.fit.std
    many = max(len(state.fit.model.terms), 1)
    for term, values in zip(state.fit.model.terms, state.fit.theta.terms, strict=True):
        if standing is not None and term in standing:
            less, others = standing[term]
        else:
            less = without(state, term, data)
            others = swaps(state, term, less, data, terms)
        gain = less.chi2 - state.fit.chi2
        close = [r for r in others if min(r.bic_loss, r.aic_loss) < NEAR and r.term.id != term.id]
        unique: dict[str, Rival] = {}
        for r in close:
            unique.setdefault(r.term.id, r)
        probability = 1.0 / (1.0 + sum(np.exp(-0.5 * max(r.bic_loss, 0.0)) for r in unique.values()))
        out.append(
            Named(
                term,
                values,
                tuple(float(s) for s in std[at : at + len(values)]),
                gain,
                gain - len(values) * logn,
                max(float(chi2_sf(max(gain, 0.0), len(values))), 1e-300),
                float(probability),
                tuple(unique.values()),
                doubts(state, term, data, many),
            )
        )
        at += len(values)
    return tuple(sorted(out, key=lambda n: -n.chi2_gain))


def with_doubts(named: Sequence[Named], left: Omnibus | None) -> tuple[Named, ...]:
    """Doubts that only show when all terms and what is left are seen together.

    Something left over a term's own coordinate: its shape is not the textbook's. Many static shapes on one curve: any
    curve can be made of enough of them.
    """
    static = [n for n in named if set(n.term.coordinates) <= set(STATIC)]
    clear = {g.coordinate.quantity: g for g in left.groups if g.p_value < OWN_COORDINATE} if left is not None else {}
    out = []
    for n in named:
        more: list[str] = []
        names = {d for c in n.term.coordinates for d in (DRIVERS if c in STATIC else (c,))}
        own = [q for q, g in clear.items() if q in names and g.statistic - g.dof > OWN_SHARE * n.chi2_gain]
        if own:
            more.append(f"more is left over its own coordinate, {own[0]}")
        if len(static) >= MANY_SHAPES and n in static:
            more.append(f"{len(static)} shapes on one static curve make any curve")
        out.append(replace(n, doubts=(*n.doubts, *more)))
    return tuple(out)
