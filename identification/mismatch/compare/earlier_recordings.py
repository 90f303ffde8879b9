"""What a second run shows beyond a twin, put to the recordings behind the twin: is it new, or was it there before?

Of each finding there are two hypotheses: the thruster has it since those recordings, or it had it then too. Under each
the twin's model is fitted to them anew, without the finding and with it, and what that leaves uncertain is allowed for
in the second run. The chi-square of both recordings under the one less that under the other is twice the logarithm of
their likelihood ratio (Neyman and Pearson, Phil. Trans. R. Soc. A 231, 1933, 289).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from identification.mismatch import policy
from identification.mismatch.compare.saved_model_baseline import lasting, starting, terms_of
from identification.mismatch.estimate.estimate import Estimate, forces, refresh
from identification.mismatch.estimate.fit_covariance import covariance
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.faults import stage as faults
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Given, Model, acting, extended, reduced
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights, weights
from identification.mismatch.prepare import stage as prepare
from identification.mismatch.prepare.preparing import Refusal
from identification.mismatch.select.baseline import level_error_factor, start
from identification.physics.term import Term
from identification.recording import Recording
from identification.twin import Twin, names_of

Since = Literal["changed", "not shown before", "there before"]


@dataclass(frozen=True, slots=True)
class Novelty:
    """Whether a finding is new."""

    since: Since
    loss: float
    """By how much chi-square of both recordings is more if the thruster had it then; negative: it had it."""


@dataclass(frozen=True, eq=False, slots=True)
class Earlier:
    """The recordings behind a twin, and its model fitted to them with nothing given."""

    twin: Twin
    data: Data
    fit: Fit
    weights: Weights


@dataclass(frozen=True, eq=False, slots=True)
class Later:
    """The run that was diagnosed against the twin, and the model that was found."""

    recordings: Sequence[Recording]
    data: Data
    found: Estimate


def put_to_earlier(
    twin: Twin | None, before: Sequence[Recording], later: Later, terms: Sequence[Term]
) -> tuple[Mapping[Term, Novelty], tuple[str, ...]]:
    """Of each of `terms` of the model found whether it is new, and a note where that cannot be asked; `before`: the
    recordings behind the twin."""
    asked = [term for term in terms if term in later.found.fit.model.terms]
    if twin is None or not before or not asked:
        return {}, ()
    earlier = fitted_again(twin, before)
    if isinstance(earlier, Refusal):
        return {}, (f"Whether what was found is new was not asked: behind {twin.origin} are {earlier.reason}.",)
    held = set.intersection(*(set(h.others) for h in earlier.data.histories))
    notes = [
        f"Whether {term.id} is new was not asked: behind {twin.origin} no {' and '.join(lacking)} was recorded."
        for term in asked
        if (lacking := sorted(set(term.needs) - held))
    ]
    new = earlier.fit.chi2 + _chi2_of(later, _as_twin(earlier, earlier.fit))
    return {t: _judged(earlier, later, t, new) for t in asked if held.issuperset(t.needs)}, tuple(notes)


def _judged(earlier: Earlier, later: Later, term: Term, new: float) -> Novelty:
    """`new`: chi-square of both recordings if it is. Where another value of what the twin has of that effect does for
    both, nothing is added to it."""
    told, instead = policy.compare.TOLD_FROM_BEFORE, np.inf
    if any(t.id == term.id for t in earlier.fit.model.terms):
        instead = _chi2_of_both(earlier, later, term, _in_its_place(earlier, later, term)) - new
        if instead < told:
            return Novelty("there before", instead)
    loss = min(instead, _chi2_of_both(earlier, later, term, _beside(earlier, later, term)) - new)
    if abs(loss) < told:
        return Novelty("not shown before", loss)
    return Novelty("changed" if loss > 0 else "there before", loss)


def fitted_again(twin: Twin, before: Sequence[Recording]) -> Earlier | Refusal:
    """The twin's terms on its own recordings, free but for what has no textbook form or stands there twice."""
    prepared = prepare.run(before, (), None)
    sound = prepared if isinstance(prepared, Refusal) else faults.run(prepared, (), twin.slip_rate)
    if isinstance(sound, Refusal):
        return sound
    data, theta = start(sound.histories)
    known = tuple(Given(t.term, t.values, t.scale) for t in twin.terms)
    free = [g for g, t in zip(known, twin.terms, strict=True) if t.flexible is None and _once(g.term, known)]
    model, theta = Model((), tuple(g for g in known if g not in free)), replace(theta, C=twin.C)
    for g in free:
        model, theta = extended(model, theta, g.term, g.values)
    found = refresh(model, theta, data, None, None)
    return Earlier(twin, data, found.fit, found.weights)


def _once(term: Term, every: Sequence[Given]) -> bool:
    return sum(g.term == term for g in every) == 1


Way = tuple[Model, Theta]


def _chi2_of_both(earlier: Earlier, later: Later, term: Term, ways: Iterable[Way]) -> float:
    """The least of all ways in which the thruster may have had it then."""
    least = np.inf
    for model, theta in ways:
        then = fit(model, theta, earlier.data, earlier.weights)
        least = min(least, then.chi2 + _chi2_of(later, _as_twin(earlier, then), term))
    return float(least)


def _held(later: Later, term: Term) -> Given:
    return Given(term, later.found.fit.values[term], later.data.scale)


def _beside(earlier: Earlier, later: Later, term: Term) -> Iterator[Way]:
    """With the value that was found later, and with the value that the earlier recordings want themselves."""
    model, theta = earlier.fit.model, earlier.fit.theta
    yield replace(model, given=(*model.given, _held(later, term))), theta
    if term not in model.terms:
        yield extended(model, theta, term, later.found.fit.values[term])


def _in_its_place(earlier: Earlier, later: Later, term: Term) -> Iterator[Way]:
    """In the place of what the twin has of that effect, and that where the later run wants it."""
    model, theta = earlier.fit.model, earlier.fit.theta
    for own in [t for t in model.terms if t.id == term.id]:
        less, rest = reduced(model, theta, (own,))
        for other in (_held(later, term), Given(own, _wanted(earlier, later, term, own), later.data.scale)):
            yield replace(less, given=(*less.given, other)), rest


def _wanted(earlier: Earlier, later: Later, term: Term, own: Term) -> tuple[float, ...]:
    """Where the later run wants a term of the twin, without what was found of that effect."""
    now = later.found
    model, theta = reduced(now.fit.model, now.fit.theta, {term, own} & set(now.fit.model.terms))
    others = tuple(g for g in model.given if (g.term.id, g.term.form) != (own.id, own.form))
    begin = earlier.fit.values[own]
    bigger, theta = extended(replace(model, given=others), theta, own, begin)
    return fit(bigger, theta, later.data, now.weights).values[own]


def _as_twin(earlier: Earlier, fitted: Fit) -> Twin:
    """The model fitted to the earlier recordings, with what they leave uncertain of it."""
    terms = terms_of(fitted, earlier.data)
    cov, at = covariance(fitted, earlier.data, earlier.weights), fitted.layout
    place = [0]
    for term, values, _ in acting(fitted.model, fitted.theta, earlier.data.scale):
        mine = any(values is own for own in fitted.theta.terms)
        place += list(range(at.of(term).start, at.of(term).stop)) if mine else [-1] * len(values)
    which = np.array(place)
    known = np.where((which[:, None] < 0) | (which < 0), 0.0, cov[np.ix_(which, which)])
    return replace(
        earlier.twin,
        C=fitted.theta.C,
        terms=terms,
        names=names_of(terms),
        covariance=tuple(map(tuple, known.tolist())),
        alternatives=(),
    )


def _chi2_of(later: Later, twin: Twin, without: Term | None = None) -> float:
    """Of the later recordings, against that twin; `without`: what it has of the model found, as it was fitted there: a
    jump is spread over some levels, and one that stands for certain at its middle is none of the model found."""
    now, data = later.found, later.data
    model, theta = reduced(now.fit.model, now.fit.theta, () if without is None else (without,))
    plain = replace(data, prior_factor=level_error_factor(data, theta.C))
    data, _, bare = starting(lasting(twin, later.recordings))(plain, replace(theta, terms=()))
    size = forces(now.fit.model, now.fit.theta, later.data)
    judged = weights(data, now.noise, size, now.rate_noise, now.rows)
    return fit(replace(model, given=_as_fitted(bare.given, without)), theta, data, judged).chi2


def _as_fitted(given: tuple[Given, ...], term: Term | None) -> tuple[Given, ...]:
    if term is None:
        return given
    return tuple(replace(g, term=term) if (g.term.id, g.term.form) == (term.id, term.form) else g for g in given)
