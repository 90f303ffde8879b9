"""Two terms of one static curve for two others: each exchange alone would be worse, for the other has grown to it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit, bounds_of, change_of, fit
from identification.mismatch.model.data import Data, price
from identification.mismatch.model.model import extended, reduced
from identification.mismatch.select.exchange.nearby_start import Start
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.limits.clipping import contradiction
from identification.physics.term import Scale, Term
from identification.recording import Floats

STATIC = ("command_voltage", "thrust")
"""Coordinates of the static curve."""
SIZES = (1.0, 3.0, 8.0)
"""Times the amount of a trial: a curve is another one where there is much of it."""
MOST_PAIRS = 4
"""Pairs of effects that are refitted, those first that do most nearly the same."""
PAIR_STEPS = 20
"""Steps of such a fit: two curves that have grown to one another turn slowly into two others."""
Tried = tuple[Term, tuple[float, ...]]


def static_curve(term: Term, *, measured: bool) -> str:
    """On which static curve a term is a shape; none: "". A measured rate makes two of one, V to n and n to thrust."""
    if not set(term.covariates) <= set(STATIC):
        return ""
    return "rate" if measured and term.stage in ("command", "rotor") else "thrust"


def two_for_two(estimate: Estimate, data: Data, terms: Sequence[Term]) -> tuple[float, Fit] | None:
    """BIC loss and fit of the best two other terms in the place of two that share a static curve; None where none is
    better."""
    now = estimate.fit
    logn, best = float(np.log(max(now.residual.size, 2))), None
    most = -policy.select.RIVAL_BETTER_BIC
    for pair in combinations(now.model.terms, 2):
        curves = {static_curve(term, measured=data.with_rate) for term in pair}
        if "" in curves or len(curves) > 1:
            continue
        for others, start in _likeliest(estimate, data, terms, pair):
            costs = logn * (sum(price(t, data) for t in others) - sum(price(t, data) for t in pair))
            rare = sum(t.traits.rare for t in others) - sum(t.traits.rare for t in pair)
            costs += policy.select.RARE_TERM_BIC * max(rare, 0)
            new = fit(*start, data, estimate.weights, PAIR_STEPS, now.chi2 + most - costs, near=now)
            loss = float(new.chi2 - now.chi2 + costs)
            if loss < most and all(_possible(t, new, estimate, data) for t in others):
                most, best = loss, (loss, new)
    return best


def _possible(term: Term, new: Fit, estimate: Estimate, data: Data) -> bool:
    return not at_bound(term, new, data, estimate.weights) and not contradiction(new, term, estimate.noise, data)


def _likeliest(
    estimate: Estimate, data: Data, terms: Sequence[Term], pair: tuple[Term, Term]
) -> list[tuple[tuple[Term, Term], Start]]:
    """Pairs that follow what `pair` does, the rest of the model moving with them, and where their fits begin."""
    now, weights = estimate.fit, estimate.weights
    rest = reduced(now.model, now.theta, pair)
    gone = {j for term in pair for j in range(now.layout.of(term).start, now.layout.of(term).stop)}
    kept = np.array([j not in gone for j in range(now.free.size)])
    basis = orthogonal_basis(now.jacobian[:, kept[now.free]])
    tried = list(_trials(data, terms, pair, now))
    changes = [change_of(rest, extended(*rest, *each), data, weights) for each in tried]
    effect = _beside(basis, weights.whiten(*change_of(rest, (now.model, now.theta), data, weights)))
    columns = [_beside(basis, weights.whiten(*each)) for each in changes]
    found: dict[frozenset[Term], tuple[float, tuple[Tried, Tried], Floats]] = {}
    for i, j in combinations(range(len(tried)), 2):
        if tried[i][0].id == tried[j][0].id:
            continue
        share, left = _followed(np.column_stack([columns[i], columns[j]]), effect)
        both = frozenset((tried[i][0], tried[j][0]))
        if np.all(share > 0) and (both not in found or left < found[both][0]):
            found[both] = (left, (tried[i], tried[j]), share)
    ranked = sorted(found.values(), key=lambda each: each[0])[:MOST_PAIRS]
    return [((one[0], two[0]), _start(rest, (one, two), share, data)) for _, (one, two), share in ranked]


def _trials(data: Data, terms: Sequence[Term], pair: tuple[Term, Term], now: Fit) -> Iterator[Tried]:
    """Of every other term on the curve, of several sizes."""
    inside = {t.id for t in now.model.terms}
    curve = static_curve(pair[0], measured=data.with_rate)
    for term in terms:
        if term.id in inside or static_curve(term, measured=data.with_rate) != curve:
            continue
        for trial in term.trials(data.scale):
            yield from ((term, (amount, *trial[1:])) for amount in _amounts(term, trial[0], data.scale))


def _amounts(term: Term, trial: float, scale: Scale) -> list[float]:
    """Within its bounds, on both sides of none where both are possible."""
    first = term.parameters(scale)[0]
    assert first.neutral is not None
    sides = (1.0,) if first.neutral in (first.low, first.high) else (1.0, -1.0)
    every = (first.neutral + side * size * (trial - first.neutral) for side in sides for size in SIZES)
    return [amount for amount in every if first.low < amount < first.high]


def _beside(basis: Floats, column: Floats) -> Floats:
    out: Floats = column - basis @ (basis.T @ column)
    return out


def _followed(columns: Floats, effect: Floats) -> tuple[Floats, float]:
    """Shares (2,) of two columns (n, 2) that follow the effect (n,) best, and the sum of squares left."""
    gram, right = columns.T @ columns, columns.T @ effect
    share: Floats = np.linalg.lstsq(gram, right, rcond=1e-9)[0].astype(np.float64)
    return share, float(effect @ effect - right @ share)


def _start(rest: Start, both: tuple[Tried, Tried], share: Floats, data: Data) -> Start:
    """The rest of the model with both, as much of each as follows."""
    model, theta = rest
    for (term, values), part in zip(both, share.tolist(), strict=True):
        first = term.parameters(data.scale)[0]
        assert first.neutral is not None
        amount = first.neutral + part * (values[0] - first.neutral)
        model, theta = extended(model, theta, term, (float(np.clip(amount, first.low, first.high)), *values[1:]))
    low, high, _ = bounds_of(model, data, theta)
    return model, theta.with_vector(np.clip(theta.vector, low, high))
