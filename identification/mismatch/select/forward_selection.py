"""From the baseline to a model: noise first, then the best few candidates fitted jointly, one more term at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.clock_hollows import STEP, by_its_clocks
from identification.mismatch.estimate.estimate import Estimate, fit_without, refresh
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.data import Data, hidden_by_steps, price
from identification.mismatch.model.model import Model, usual_form
from identification.mismatch.model.parameters import Theta
from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.select.baseline import baseline, every_shape, plain_shapes, start
from identification.mismatch.select.exchange.nearby_start import best_forms
from identification.mismatch.select.exchange.rivals import one_for_two, one_less, swaps
from identification.mismatch.select.exchange.static_pairs import static_curve, two_for_two
from identification.mismatch.select.hidden import hidden
from identification.mismatch.select.limits.clipping import contradiction
from identification.mismatch.select.rounds import Candidate, Round, Unhidden
from identification.mismatch.select.screening import (
    Screening,
    directions,
    refined,
    screen,
)
from identification.mismatch.select.shape_error import allowed, corrections
from identification.mismatch.select.stepwise import RivalTerm, Standing, accept_threshold, forward, pruned
from identification.physics.catalogue import CATALOGUE
from identification.physics.term import Term
from identification.run_history.history import History

CANDIDATES = 5
"""Terms of a round that are fitted: a fit costs as much as the screening of all."""
MOST_MORE = 3
"""Terms of a round that are fitted beside CANDIDATES: those whose trials say little of what a fit would find."""
NOT_ALL = "whether more is left out"


def available(data: Data, without: Collection[str] = ()) -> tuple[Term, ...]:
    """Terms of the catalogue whose channels were recorded in every run, but for the effects `without`.

    What stands for a channel is among them where that was not recorded, or in a few steps only.
    """
    have = set.intersection(*(set(h.others) for h in data.histories))
    if data.scale.torque <= 0:
        have.discard("torque")  # a channel of zeros
    fine = have.difference(*(h.coarse for h in data.histories))
    static = any(h.static for h in data.histories)
    out = []
    for term in CATALOGUE:
        if term.id in without or not set(term.needs) <= have or (static and term.traits.moving):
            continue
        if data.histories[0].driver_quantity == "rotation_rate" and term.stage in ("command", "rotor"):
            continue
        if term.traits.flow and data.scale.flow <= 0:
            continue
        if term.traits.own_clock and term.traits.instant and len(data.histories) > 1:
            continue  # what comes at one instant of every run follows the command
        if term.traits.seen_by in fine - set(term.needs):
            continue
        out.append(term)
    return tuple(out)


Rival = RivalTerm[Term, Fit]
SwapTest = Standing[Fit, Term]


@dataclass(frozen=True, eq=False)
class Selected:
    """What the search ends with."""

    data: Data
    terms: tuple[Term, ...]
    """Of the catalogue, that could be chosen."""
    before: Estimate
    """The baseline."""
    after: Estimate
    rounds: tuple[Round[Term, Screening], ...]
    """Of the search, and of one that was resumed: then it begins with a model that is not the last that lasted."""
    last: Screening | None
    """Of the model `after`; None once it was exchanged for another."""
    standing: Mapping[Term, SwapTest] | None = None
    """How each term stands against its rivals, where that is known."""
    undone: tuple[str, ...] = ()
    """What was not asked, as clauses, because the search was interrupted."""


Given = Callable[[Data, Theta], tuple[Data, Theta, Model]]
"""The baseline of a twin in the place of C V|V|."""


def search(
    histories: Sequence[History],
    rng: np.random.Generator,
    given: Given | None = None,
    bands: tuple[tuple[float, float], ...] = (),
    without: Collection[str] = (),
    watch: Observer = UNWATCHED,
) -> Selected:
    """Forward: screen, fit the best few, keep the best, refresh the noise; until nothing passes. Then prune.

    `given` puts the baseline of a twin in the place of C V|V|; effects `without` are taken out of the catalogue.
    """
    data, terms, before = beginning(histories, given, bands, without)
    return onwards(data, terms, before, before, rng, watch)


def beginning(
    histories: Sequence[History],
    given: Given | None,
    bands: tuple[tuple[float, float], ...],
    without: Collection[str],
) -> tuple[Data, tuple[Term, ...], Estimate]:
    """What a search begins with: the runs, the terms that may be chosen, and the baseline with its noise."""
    data, theta = start(histories)
    data, theta, first = given(data, theta) if given is not None else (data, theta, Model())
    data = replace(data, bands=bands)
    terms = tuple(t for t in available(data, without) if _beside(first, t))
    return data, terms, baseline(data, theta, terms, first)


def _beside(known: Model, term: Term) -> bool:
    """Whether a term may be sought beside the baseline: what that has of an effect changes in its own form."""
    return all(term.id != g.term.id or term.form == g.term.form for g in known.given)


def resumed(found: Selected, estimate: Estimate, rng: np.random.Generator, watch: Observer = UNWATCHED) -> Selected:
    """The search gone on with from `estimate`, a model of the same recordings that is not the one that was `found`."""
    known = frozenset(found.after.fit.model.terms)
    again = onwards(found.data, found.terms, found.before, estimate, rng, watch, known)
    return replace(again, rounds=(*found.rounds, *again.rounds))


def onwards(
    data: Data,
    terms: tuple[Term, ...],
    before: Estimate,
    estimate: Estimate,
    rng: np.random.Generator,
    watch: Observer,
    *known: frozenset[Term],
) -> Selected:
    """Larger models from `estimate` on while something passes, none of those that are `known`."""
    system = Thruster(data, terms, watch)
    after, rounds, whole = forward(system, estimate, policy.select.MODEL_TERMS, rng, known)
    undone = () if whole else (NOT_ALL,)
    return Selected(data, terms, before, after, rounds, rounds[-1].screening if whole else None, undone=undone)


def prune(estimate: Estimate, data: Data) -> Estimate:
    """Drop terms that no longer earn their place."""
    return pruned(Thruster(data, ()), estimate)


@dataclass(frozen=True, eq=False, slots=True)
class Thruster:
    """Runs of a thruster, and terms that may explain them: a `System` of stepwise selection."""

    data: Data
    terms: tuple[Term, ...]
    watch: Observer = UNWATCHED

    def judged(self, estimate: Estimate, rng: np.random.Generator) -> Screening:
        """What may still be added to the model, judged."""
        self.watch.trying(f"all of the catalogue beside {_told(estimate.fit.model.terms)}")
        data, inside = self.data, estimate.fit.model.terms
        ids = {t.id for t in inside}
        shapes = Counter(static_curve(t, measured=data.with_rate) for t in inside)
        left = [t for t in self.terms if t.id not in ids and not t.traits.closer]
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

    def additions(self, estimate: Estimate, judged: Screening) -> list[tuple[Candidate[Term], Fit]]:
        """Candidates, fitted, that gain more than their parameters cost; one that plainly stays behind another is not
        fitted to its end."""
        data, weights = self.data, estimate.weights
        logn = float(np.log(estimate.fit.residual.size))
        found, most = [], 0.0
        for term, values in _candidates(judged, data) if judged.largest > judged.threshold else []:
            self.watch.trying(f"{term.id} beside {_told(estimate.fit.model.terms)}")
            bigger, theta = estimate.fit.more(term, refined(estimate.fit, data, weights, term, values))
            cost = price(term, data) * logn
            behind = estimate.fit.chi2 - cost - policy.select.SIMPLER_TERM_GAIN * most
            new = fit(bigger, theta, data, weights, hopeless=behind if most > 0 else np.inf, near=estimate.fit)
            gain = estimate.fit.chi2 - new.chi2
            if gain > max(cost, logn):
                pressed = at_bound(term, new, data, weights)
                found.append((Candidate(term, gain, cost, pressed), new))
                most = most if pressed else max(most, gain - cost)
        return [self._by_the_best_clocks(estimate, each, found) for each in found]

    def _by_the_best_clocks(
        self, estimate: Estimate, each: tuple[Candidate[Term], Fit], found: list[tuple[Candidate[Term], Fit]]
    ) -> tuple[Candidate[Term], Fit]:
        candidate, fitted = each
        best = max(found, key=lambda other: other[0].chi2_gain)[1]
        new = by_its_clocks(fitted, best, self.data, estimate.weights)
        pressed = candidate.at_bound if new is fitted else at_bound(candidate.term, new, self.data, estimate.weights)
        return replace(candidate, chi2_gain=estimate.fit.chi2 - new.chi2, at_bound=pressed), new

    def enlarged(self, estimate: Estimate, best: Fit) -> Estimate:
        """The model with one more term, as fitted, its noise estimated anew."""
        remaining = [t for t in self.terms if t.id not in {u.id for u in best.model.terms}]
        plain = plain_shapes(best, self.data, estimate.weights, every_shape(best, self.data, remaining))
        return refresh(best.model, best.theta, self.data, plain, estimate)

    def reformed(self, estimate: Estimate) -> Estimate:
        better = best_forms(estimate.fit, self.terms, self.data, estimate.weights, estimate.noise)
        return estimate if better is estimate.fit else self.enlarged(estimate, better)

    def unhidden(self, estimate: Estimate, judged: Screening) -> tuple[Unhidden, Estimate] | None:
        return hidden(estimate, judged, self.data)

    def without(self, estimate: Estimate, term: Term) -> Fit:
        self.watch.trying(f"the model without {term.id}")
        return fit_without(estimate, term, self.data)

    def nearly_without(self, estimate: Estimate, term: Term, hopeless: float) -> Fit:
        self.watch.trying(f"the model without {term.id}")
        return fit_without(estimate, term, self.data, hopeless)

    def replaced(self, estimate: Estimate, other: Fit) -> Estimate:
        return refresh(other.model, other.theta, self.data, None, estimate)

    def rivals(self, estimate: Estimate, term: Term, less: Fit, stood: Mapping[Term, tuple[float, ...]]) -> list[Rival]:
        self.watch.trying(f"rivals of {term.id}")
        return swaps(estimate, term, less, self.data, self.terms, stood)

    def impossible(self, estimate: Estimate, term: Term) -> bool:
        """Its values end at what is possible, or what else was recorded contradicts that it clips."""
        return at_bound(term, estimate.fit, self.data, estimate.weights) or bool(
            contradiction(estimate.fit, term, estimate.noise, self.data)
        )

    def rarer(self, term: Term, other: Term) -> bool:
        """Never against a twin: what most thrusters have all the time is no likelier to have come since. As a rare one
        counts what a few steps of a channel say of an effect, before what stands for that channel."""
        if term.id == other.id and hidden_by_steps(term, self.data) > hidden_by_steps(other, self.data):
            return True
        return self.data.constant_before is None and term.traits.rare and not other.traits.rare

    def usual_form(self, term: Term, other: Term) -> bool:
        return usual_form(term, other, self.data.scale)

    def begun_better(self, estimate: Estimate, other: Estimate) -> bool:
        """The clocks stood in a wrong hollow, and a delay that was tried led to the right one."""
        moved = abs(other.fit.theta.shift - estimate.fit.theta.shift) > STEP
        return moved and estimate.fit.deviance - other.fit.deviance > accept_threshold(1)

    def merged(self, estimate: Estimate, standing: Mapping[Term, SwapTest]) -> tuple[float, Fit] | None:
        self.watch.trying("one term in the place of two")
        best = one_less(estimate, self.data, self.terms)
        best = one_for_two(estimate, self.data, self.terms, standing, best)
        if best is not None:
            return best
        self.watch.trying("two terms of a static curve in the place of two")
        return two_for_two(estimate, self.data, self.terms)


def _told(terms: Collection[Term]) -> str:
    return ", ".join(term.id for term in terms) or "the baseline"


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
