"""From the baseline to a model: noise first, then the best few candidates fitted jointly, one more term at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.tails import chi2_isf
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, fit_without, refresh
from identification.mismatch.estimate.fitting import Fit, at_bound, fit
from identification.mismatch.model.data import Data, price
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.select.baseline import baseline, every_shape, plain_shapes, start
from identification.mismatch.select.rounds import Candidate, Round, Unhidden
from identification.mismatch.select.screening import (
    Screening,
    directions,
    refined,
    screen,
)
from identification.mismatch.select.shape_error import allowed, corrections
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import Term
from identification.run_history.history import History

CANDIDATES = 5
"""Terms of a round that are fitted: a fit costs as much as the screening of all."""
MOST_MORE = 3
"""Terms of a round that are fitted beside CANDIDATES: those whose trials say little of what a fit would find."""
SLOW_COVARIATES = frozenset({"time", "flow_speed"})
"""Coordinates along which nothing changes quickly: slow noise takes for its own what an effect does over them."""
MOST_HIDDEN = 3
"""Terms of a round that are estimated together with the noise: each costs a search for variances."""
MOST_INSTANTS = 5
"""Trials of a jump that is hidden: which is the best depends on the noise, and each costs a search for variances."""
INSTANTS_APART = 0.05
"""Of the run: trials of a jump that is hidden."""
STATIC = ("command_voltage", "thrust")
"""Coordinates of the static curve."""


def available(data: Data, without: Collection[str] = ()) -> tuple[Term, ...]:
    """Terms of the catalogue whose channels were recorded in every run, but for the effects `without`."""
    have = set.intersection(*(set(h.others) for h in data.histories))
    if data.scale.torque <= 0:
        have.discard("torque")  # a channel of zeros
    static = any(h.static for h in data.histories)
    out = []
    for term in CATALOGUE:
        if term.id in without or not set(term.needs) <= have or (static and term.traits.moving):
            continue
        if data.histories[0].driver_quantity == "rotation_rate" and term.stage in ("command", "rotor"):
            continue
        if term.traits.flow and data.scale.flow <= 0:
            continue
        if term.traits.seen_by in have - set(term.needs):
            continue
        out.append(term)
    return tuple(out)


@dataclass(frozen=True, eq=False, slots=True)
class Rival:
    """Another term in the place of one, refitted."""

    term: Term
    fit: Fit
    bic_loss: float
    """By how much its BIC is worse."""
    aic_loss: float
    """By how much its AIC is worse: BIC alone would hide a rival with more parameters than the data can tell apart."""


SwapTest = tuple[Fit, list[Rival]]
"""The fit without a term, and the rivals in its place."""


@dataclass(frozen=True, eq=False)
class Selected:
    """What the search ends with."""

    data: Data
    terms: tuple[Term, ...]
    """Of the catalogue, that could be chosen."""
    before: Estimate
    """The baseline."""
    after: Estimate
    rounds: tuple[Round, ...]
    """Of the search, and of one that was resumed: then it begins with a model that is not the last that lasted."""
    last: Screening | None
    """Of the model `after`; None once it was exchanged for another."""
    standing: Mapping[Term, SwapTest] | None = None
    """How each term stands against its rivals, where that is known."""


def static_curve(term: Term, *, measured: bool) -> str:
    """On which static curve a term is a shape; none: "". A measured rate makes two of one, V to n and n to thrust."""
    if not set(term.covariates) <= set(STATIC):
        return ""
    return "rate" if measured and term.stage in ("command", "rotor") else "thrust"


def accept_threshold(extra: int) -> float:
    return chi2_isf(policy.select.KEPT_TERM_FALSE_ALARM, extra)


def search(
    histories: Sequence[History],
    rng: np.random.Generator,
    given: Callable[[Data, Theta], tuple[Data, Theta, Model]] | None = None,
    bands: tuple[tuple[float, float], ...] = (),
    without: Collection[str] = (),
) -> Selected:
    """Forward: screen, fit the best few, keep the best, refresh the noise; until nothing passes. Then prune.

    `given` puts the baseline of a twin in the place of C V|V|; effects `without` are taken out of the catalogue.
    """
    data, theta = start(histories)
    data, theta, first = given(data, theta) if given is not None else (data, theta, Model())
    data = replace(data, bands=bands)
    terms = available(data, without)
    before = baseline(data, theta, terms, first)
    return _forward(data, terms, before, before, rng)


def resumed(found: Selected, estimate: Estimate, rng: np.random.Generator) -> Selected:
    """The search gone on with from `estimate`, a model of the same recordings that is not the one that was `found`."""
    known = frozenset(found.after.fit.model.terms)
    again = _forward(found.data, found.terms, found.before, estimate, rng, known)
    return replace(again, rounds=(*found.rounds, *again.rounds))


def _forward(
    data: Data,
    terms: Sequence[Term],
    before: Estimate,
    estimate: Estimate,
    rng: np.random.Generator,
    *known: frozenset[Term],
) -> Selected:
    """Larger models from `estimate` on while something passes, none of those that are `known`."""
    rounds = []
    seen = {frozenset(estimate.fit.model.terms), *known}
    while True:
        inside = estimate.fit.model.terms
        judged = _screened(estimate, data, terms, rng)
        full = len({t.id for t in inside}) >= policy.select.MODEL_TERMS
        larger = _Lasting(None) if full else _lasting(estimate, judged, data, terms, seen)
        found = larger.estimate
        after = None if found is None else found.fit.model.terms
        rounds.append(Round(inside, judged, larger.fitted, larger.hidden, after))
        if found is None:
            break
        estimate = found
        seen.add(frozenset(estimate.fit.model.terms))
    return Selected(data, tuple(terms), before, estimate, tuple(rounds), judged)


def _screened(estimate: Estimate, data: Data, terms: Sequence[Term], rng: np.random.Generator) -> Screening:
    """What may still be added to the model, judged."""
    inside = estimate.fit.model.terms
    ids = {t.id for t in inside}
    shapes = Counter(static_curve(t, measured=data.with_rate) for t in inside)
    left = [t for t in terms if t.id not in ids]
    left = [
        t
        for t in left
        if not (on := static_curve(t, measured=data.with_rate)) or shapes[on] < policy.select.STATIC_CURVE_TERMS
    ]
    if data.scale.torque <= 0 and any(t.traits.even for t in inside):
        left = [t for t in left if not t.traits.even]
    found = directions(estimate.fit, data, estimate.weights, left)
    changes = corrections(estimate.fit, data, estimate.weights)
    spared = allowed(changes, found.columns, policy.select.NEXT_TERM_SHAPE_ERROR)
    return screen(estimate.fit, found, rng, spared)


@dataclass(frozen=True, eq=False, slots=True)
class _Lasting:
    """A larger model, and as of Round how it was found."""

    estimate: Estimate | None
    fitted: tuple[Candidate, ...] = ()
    hidden: Unhidden | None = None


def _lasting(
    estimate: Estimate, judged: Screening, data: Data, terms: Sequence[Term], seen: Collection[frozenset[Term]]
) -> _Lasting:
    """The larger model, pruned; of additions that are dropped again the next best. Without one where none lasts."""
    found = _additions(estimate, judged, data) if judged.largest > judged.threshold else []
    fitted = tuple(candidate for candidate, _ in found)
    while found:
        larger = _larger(estimate, _best(found), data, terms)
        pruned = prune(larger, data)
        if frozenset(pruned.fit.model.terms) not in seen:
            return _Lasting(pruned, fitted)
        refused = set(larger.fit.model.terms) - set(estimate.fit.model.terms)
        found = [each for each in found if each[0].term not in refused]
    hidden = _hidden(estimate, judged, data)
    if hidden is None:
        return _Lasting(None, fitted)
    told, beside = hidden
    pruned = prune(beside, data)
    last = None if frozenset(pruned.fit.model.terms) in seen else pruned
    return _Lasting(last, fitted, None if last is None else told)


def _larger(estimate: Estimate, best: Fit, data: Data, terms: Sequence[Term]) -> Estimate:
    """The model with one more term, as fitted, its noise estimated anew."""
    remaining = [t for t in terms if t.id not in {u.id for u in best.model.terms}]
    plain = plain_shapes(best, data, estimate.weights, every_shape(best, data, remaining))
    return refresh(best.model, best.theta, data, plain, estimate)


def _hidden(estimate: Estimate, judged: Screening, data: Data) -> tuple[Unhidden, Estimate] | None:
    """The model with a term that the noise had taken for its own: they are told apart when estimated together."""
    least = (
        policy.select.HIDDEN_FIRST_TERM_SIGMA if not estimate.fit.model.terms else np.inf
    )  # shape error would be taken for what is hidden
    likely = [
        (t, v)
        for rank, (t, v, z) in enumerate(judged.best(2 * MOST_HIDDEN))
        if (rank < MOST_HIDDEN or t.traits.one_shape)
        and z > (policy.select.HIDDEN_SIGMA if SLOW_COVARIATES & set(t.covariates) else least)
    ]
    likely = [each for t, v in likely for each in ((t, at) for at in _instants(judged, t, data) or (v,))]
    if not likely:
        return None
    now = refresh(estimate.fit.model, estimate.fit.theta, data, None, None)
    found = []
    for term, values in likely:
        begin = refined(estimate.fit, data, estimate.weights, term, values)
        bigger, theta = estimate.fit.more(term, begin)
        first = fit(bigger, theta, data, estimate.weights)
        new = refresh(bigger, first.theta, data, None, now, now.noise)
        gain = now.fit.deviance - new.fit.deviance
        if gain > (asked := _asked_of_hidden(term, judged, data)):
            found.append((Unhidden(gain, asked), new))
    if not found:
        return None
    told, best = max(found, key=lambda each: each[0].gain)
    return told, refresh(best.fit.model, best.fit.theta, data, None, None)


def _instants(judged: Screening, term: Term, data: Data) -> list[tuple[float, ...]]:
    """Of a jump in time the likeliest trials: which is the best depends on the noise, and that takes it for its own."""
    if not term.traits.instant:
        return []
    place = [p.name for p in term.parameters(data.scale)].index(term.traits.instant)
    out: list[tuple[float, ...]] = []
    for j in np.argsort(-judged.plain):
        at = judged.directions.values[j]
        if judged.directions.terms[j] == term and all(
            abs(at[place] - v[place]) > INSTANTS_APART * data.scale.duration for v in out
        ):
            out.append(at)
        if len(out) == MOST_INSTANTS:
            break
    return out


def _asked_of_hidden(term: Term, judged: Screening, data: Data) -> float:
    """Gain in deviance from which a term that is told from noise by estimating both is believed."""
    if term.traits.one_shape:
        return chi2_isf(policy.select.STEADY_TERM_FALSE_ALARM, price(term, data))
    share = 1.0 if term.traits.from_data else _share_of_hidden(term)
    return float(judged.threshold**2 + share * price(term, data) * np.log(data.size))


def _share_of_hidden(term: Term) -> float:
    return float(policy.select.HIDDEN_OFFSET_PRICE if term.traits.instant else policy.select.HIDDEN_TERM_PRICE)


def _candidates(judged: Screening, data: Data) -> list[tuple[Term, tuple[float, ...]]]:
    """The likeliest terms, and a few of those whose trials say little of what a fit would find: jumps between levels,
    of which no trial is near unless it is the right one, and what comes late where clocks that differ may hide it."""
    likely = {term: values for term, values, _ in judged.best(CANDIDATES)}
    late = any(term.traits.delays for term in likely)
    most = len(likely) + MOST_MORE
    for term, values, z in judged.best(len(judged.directions.terms), share=0.0):
        told = (late and term.traits.delays) or any(p.jumps for p in term.parameters(data.scale))
        if told and z > judged.threshold and len(likely) < most:
            likely.setdefault(term, values)
    return list(likely.items())


def _additions(estimate: Estimate, judged: Screening, data: Data) -> list[tuple[Candidate, Fit]]:
    """Candidates, fitted, that gain more than their parameters cost."""
    found = []
    for term, values in _candidates(judged, data):
        begin = refined(estimate.fit, data, estimate.weights, term, values)
        bigger, theta = estimate.fit.more(term, begin)
        new = fit(bigger, theta, data, estimate.weights)
        gain = estimate.fit.chi2 - new.chi2
        logn = float(np.log(new.residual.size))
        cost = price(term, data) * logn
        if gain > max(cost, logn):
            found.append((Candidate(term, gain, cost, at_bound(term, new, data, estimate.weights)), new))
    return found


def _best(found: Sequence[tuple[Candidate, Fit]]) -> Fit:
    gains = [candidate.chi2_gain - candidate.price for candidate, _ in found]
    sizes = [len(fitted.values[candidate.term]) for candidate, fitted in found]
    return found[preferred(gains, sizes, [candidate.at_bound for candidate, _ in found])][1]


def preferred(gains: Sequence[float], sizes: Sequence[int], pressed: Sequence[bool]) -> int:
    """Which addition goes first: the best gain beyond its price, or a simpler one that gains nearly as much.

    `sizes`: the number of parameters of each; `pressed`: against the end of what is possible, so that others go before.
    """
    possible = [j for j, ended in enumerate(pressed) if not ended] or range(len(gains))
    most = max(gains[j] for j in possible)
    near = [j for j in possible if gains[j] >= policy.select.SIMPLER_TERM_GAIN * most]
    return min(near, key=lambda j: (sizes[j], -gains[j]))


def prune(estimate: Estimate, data: Data) -> Estimate:
    """Drop terms that no longer earn their place."""
    while estimate.fit.model.terms:
        less = [fit_without(estimate, term, data) for term in estimate.fit.model.terms]
        losses = [each.chi2 - estimate.fit.chi2 for each in less]
        worst = least_earned(losses, [len(values) for values in estimate.fit.values.values()])
        if worst is None:
            break
        estimate = refresh(less[worst].model, less[worst].theta, data, None, estimate)
    return estimate


def least_earned(losses: Sequence[float], sizes: Sequence[int]) -> int | None:
    """Which term gives the model least beside its price; None where all earn their place.

    `losses`: of chi-square without each; `sizes`: the number of parameters of each.
    """
    short = [loss - accept_threshold(size) for loss, size in zip(losses, sizes, strict=True)]
    worst = short.index(min(short))
    return None if short[worst] > 0 else worst
