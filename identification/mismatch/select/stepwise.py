"""Stepwise selection, written once for whatever is modelled: terms added, dropped, and exchanged for their rivals."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from identification.estimation.tails import chi2_isf
from identification.mismatch import policy
from identification.mismatch.observer import Interrupted
from identification.mismatch.select.rounds import Candidate, Judged, Round, T, Unhidden
from identification.recording import Floats

ROUNDS = 4
"""Exchanges of a term for a rival, at most: more would go in circles."""


class Fitted(Protocol):
    """A model at its best values."""

    @property
    def chi2(self) -> float: ...

    @property
    def residual(self) -> Floats:
        """(n,) whitened."""

    @property
    def values(self) -> Mapping[Any, tuple[float, ...]]:
        """Of each term of the model."""

    @property
    def std(self) -> Floats:
        """Standard errors of all parameters, in the order of `layout`."""

    @property
    def layout(self) -> Any:
        """Where the parameters of each term stand among all: `layout.of(term)`."""


class Weighed(Protocol):
    """A model as fitted, with the noise that weighs it."""

    @property
    def fit(self) -> Any: ...


F = TypeVar("F", bound=Fitted)
S = TypeVar("S", bound=Weighed)


@dataclass(frozen=True, eq=False, slots=True)
class RivalTerm(Generic[T, F]):
    """Another term in the place of one, refitted."""

    term: T
    fit: F
    bic_loss: float
    """By how much its BIC is worse."""
    aic_loss: float
    """By how much its AIC is worse: BIC alone would hide a rival with more parameters than the data can tell apart."""


Standing = tuple[F, list[RivalTerm[T, F]]]
"""The fit without a term, and the rivals in its place."""


class System(Protocol[T, F, S, Judged]):
    """What is modelled, as a search asks it; `state` is a model of it, fitted, with the noise that weighs it."""

    def judged(self, state: S, rng: np.random.Generator, /) -> Judged:
        """What may still be added to the model, against what it leaves."""

    def additions(self, state: S, judged: Judged, /) -> list[tuple[Candidate[T], F]]:
        """Of what passes the likeliest, fitted: those that gain more than their parameters cost."""

    def enlarged(self, state: S, larger: F, /) -> S:
        """A larger model, its noise estimated anew beside all that may still be added."""

    def reformed(self, state: S, /) -> S:
        """The same effects in the forms that fit best; `state` itself where they are those."""

    def unhidden(self, state: S, judged: Judged, /) -> tuple[Unhidden, S] | None:
        """The model with a term that the noise had taken for its own."""

    def without(self, state: S, term: T, /) -> F:
        """The rest of the model, refitted."""

    def nearly_without(self, state: S, term: T, hopeless: float, /) -> F:
        """The same, as far as it takes to see whether chi-square falls below `hopeless`."""

    def replaced(self, state: S, other: F, /) -> S:
        """A smaller model, or one with a rival, in the place of the model."""

    def rivals(self, state: S, term: T, less: F, stood: Mapping[T, tuple[float, ...]], /) -> list[RivalTerm[T, F]]:
        """Terms that could do what this one does, each refitted in its place, best first; `less`: without it. `stood`:
        terms that stood in its place before, with their values."""

    def impossible(self, state: S, term: T, /) -> bool:
        """Whether the values of a term are none that it can have."""

    def rarer(self, term: T, other: T, /) -> bool:
        """Whether `other` is the ordinary one of two, and is named where both do as well."""

    def usual_form(self, term: T, other: T, /) -> bool:
        """Whether they are forms of one effect, and `term` is the first of them that textbooks have."""

    def begun_better(self, state: S, other: S, /) -> bool:
        """Whether the same terms are fitted better in `other`, where a search for one more had led and it fell away."""

    def merged(self, state: S, standing: Mapping[T, Standing[F, T]], /) -> tuple[float, F] | None:
        """A better model that no exchange of one term leads to, a BIC loss and a fit: one term for two, or one less.

        `standing`: how each term of the model stands."""


def forward(
    system: System[T, F, S, Judged],
    state: S,
    most: int,
    rng: np.random.Generator,
    known: Collection[frozenset[T]] = (),
) -> tuple[S, tuple[Round[T, Judged], ...], bool]:
    """Larger models, of `most` terms and one that noise had hidden, while something passes, none of those that are
    `known`; how it went, and whether it came to its end: one that is interrupted has the model of its last round."""
    rounds: list[Round[T, Judged]] = []
    seen = {frozenset(state.fit.values), *known}
    while True:
        try:
            larger = _round(system, state, most, rng, seen, rounds)
        except Interrupted:
            return state, tuple(rounds), False
        if larger is None:
            return state, tuple(rounds), True
        state = larger
        seen.add(frozenset(state.fit.values))


def _round(
    system: System[T, F, S, Judged],
    state: S,
    most: int,
    rng: np.random.Generator,
    seen: Collection[frozenset[T]],
    rounds: list[Round[T, Judged]],
) -> S | None:
    """A larger model that lasts, none of those `seen`; what was done is put to the `rounds`."""
    inside = tuple(state.fit.values)
    judged = system.judged(state, rng)
    full = len(inside) >= most
    found = [] if full else system.additions(state, judged)
    told, larger = None, _reformed(system, _lasting(system, state, found, seen), seen)
    if larger is None and len(inside) <= most and (hidden := system.unhidden(state, judged)) is not None:
        beside = pruned(system, hidden[1])
        if frozenset(beside.fit.values) not in seen:
            told, larger = hidden[0], beside
    fitted = tuple(candidate for candidate, _ in found)
    rounds.append(Round(inside, judged, fitted, told, None if larger is None else tuple(larger.fit.values)))
    return larger


def _reformed(system: System[T, F, S, Judged], larger: S | None, seen: Collection[frozenset[T]]) -> S | None:
    """The larger model in its best forms, pruned; as it is where that has been there before."""
    if larger is None or (other := system.reformed(larger)) is larger:
        return larger
    other = pruned(system, other)
    return larger if frozenset(other.fit.values) in seen else other


def _lasting(
    system: System[T, F, S, Judged],
    state: S,
    found: Sequence[tuple[Candidate[T], F]],
    seen: Collection[frozenset[T]],
) -> S | None:
    """The larger model, pruned; of additions that are dropped again the next best, unless the model they were added to
    is better for it. None where none lasts."""
    while found:
        larger = system.enlarged(state, _best(system, found))
        smaller = pruned(system, larger)
        if frozenset(smaller.fit.values) not in seen or _is_better(system, state, smaller):
            return smaller
        refused = set(larger.fit.values) - set(state.fit.values)
        found = [each for each in found if each[0].term not in refused]
    return None


def _is_better(system: System[T, F, S, Judged], state: S, other: S) -> bool:
    return set(other.fit.values) == set(state.fit.values) and system.begun_better(state, other)


def _best(system: System[T, F, S, Judged], found: Sequence[tuple[Candidate[T], F]]) -> F:
    """The best gain beyond its price, or a simpler term that gains nearly as much; first what is possible, and before
    a rare one the ordinary one that is hardly worse: what comes later is chosen beside it, and would keep it."""
    possible = [each for each in found if not each[0].at_bound] or found
    most = max(map(_worth, possible))
    near = [each for each in possible if _worth(each) >= policy.select.SIMPLER_TERM_GAIN * most]
    best = min(near, key=lambda each: (len(each[1].values[each[0].term]), -_worth(each)))
    alike = [each for each in near if _worth(each) > _worth(best) - policy.select.RIVAL_BETTER_BIC]
    best = next((each for each in alike if system.usual_form(each[0].term, best[0].term)), best)
    least = _worth(best) - policy.select.RARE_TERM_BIC
    ordinary = [each for each in possible if system.rarer(best[0].term, each[0].term) and _worth(each) > least]
    return max(ordinary, key=_worth, default=best)[1]


def _worth(each: tuple[Candidate[T], F]) -> float:
    """What it gains beyond its price."""
    return each[0].chi2_gain - each[0].price


def pruned(system: System[T, F, S, Judged], state: S) -> S:
    """Without terms that give less than their price, worst first."""
    while state.fit.values:
        worth = {term: state.fit.chi2 + accept_threshold(len(values)) for term, values in state.fit.values.items()}
        less = [system.nearly_without(state, term, least) for term, least in worth.items()]
        short = [each.chi2 - least for each, least in zip(less, worth.values(), strict=True)]
        if min(short) > 0:
            break
        state = system.replaced(state, less[short.index(min(short))])
    return state


def asked_again(
    system: System[T, F, S, Judged], state: S, missed: Callable[[S, S, Judged], bool], rng: np.random.Generator
) -> S:
    """Pruned, and without the weakest term as long as that is not missed: a search from nothing would not have come to
    a model that has it. `missed` is given the model, the one without the term, and what that one's screening says."""
    state = pruned(system, state)
    while state.fit.values:
        less = [system.without(state, term) for term in state.fit.values]
        smaller = system.replaced(state, min(less, key=lambda each: each.chi2))
        if missed(state, smaller, system.judged(smaller, rng)):
            break
        state = smaller
    return state


def accept_threshold(extra: int) -> float:
    """The fall of chi-square that `extra` parameters must be worth for a term to stay (KEPT_TERM_FALSE_ALARM)."""
    return chi2_isf(policy.select.KEPT_TERM_FALSE_ALARM, extra)


def exchanged(system: System[T, F, S, Judged], state: S) -> tuple[S, dict[T, Standing[F, T]] | None]:
    """Exchange a term for a rival wherever that makes the BIC smaller; and how each term stands in the end. A model
    that was left for values that are not possible is not come back to."""
    left = set[frozenset[T]]()
    stood: dict[T, tuple[float, ...]] = {}
    for _ in range(ROUNDS):
        best: tuple[float, F] | None = None
        standing = {term: stands(system, state, term, stood) for term in state.fit.values}
        for term, (less, rivals) in standing.items():
            # a value that is not possible explains nothing: whatever does nearly as well goes before it
            price = 0.0
            if system.impossible(state, term):
                price = policy.select.PRESSED_TERM_HANDICAP * (less.chi2 - state.fit.chi2)
            for rival in rivals:
                if frozenset(rival.fit.values) in left:
                    continue
                # a rarer one stays only where it is better by more than this: it must be so to come at all
                rarer = int(system.rarer(term, rival.term)) - int(system.rarer(rival.term, term))
                ordinary = rarer * policy.select.RARE_TERM_BIC
                loss = rival.bic_loss - (max(price, ordinary) if price > 0 else ordinary)
                lasts = less.chi2 - rival.fit.chi2 > accept_threshold(len(rival.fit.values[rival.term]))
                if lasts and loss < -policy.select.RIVAL_BETTER_BIC and (best is None or loss < best[0]):
                    best = (loss, rival.fit)
        best = best or system.merged(state, standing)
        if best is None:
            return state, standing
        if any(system.impossible(state, term) for term in state.fit.values):
            left.add(frozenset(state.fit.values))
        else:
            stood |= state.fit.values
        state = _exchanged(system, state, best[1])
    return state, None


def _exchanged(system: System[T, F, S, Judged], state: S, other: F) -> S:
    """With `other` in the place of the model, less what gives nothing beside the effect that came: it would have rivals
    by the dozen, each as good. Not pruned where that effect, or the form that came, would itself go."""
    whole = system.replaced(state, other)
    smaller = pruned(system, whole)
    before = {term.id for term in state.fit.values}
    new = set(whole.fit.values) - set(state.fit.values)
    came = {term for term in new if term.id not in before} or new
    return smaller if came <= set(smaller.fit.values) else whole


def stands(
    system: System[T, F, S, Judged], state: S, term: T, stood: Mapping[T, tuple[float, ...]] = MappingProxyType({})
) -> Standing[F, T]:
    """How a term stands: the model without it, and its rivals, among them those that `stood` there before."""
    less = system.without(state, term)
    return less, system.rivals(state, term, less, stood)
