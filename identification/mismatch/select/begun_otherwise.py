"""A second search, without a term that may have led the first astray; the better of the two models is kept.

A greedy search goes on from what it took first. One term that follows the measured rate takes at once all that a drive
does before the rotor, and no round asks any more which effects that is: a winding loss beside a dead band was told as
a drive that saturates, a coupling for the rest, and C far off. A stand that rings slowly, taken early for a winding
loss, a lag and the water together, made the others take a wrong size and form, and stayed for the little that was left.
A drive that saturates from a fifth of the command on, where it can begin at the earliest, stood for a winding loss. And
a term that came first stays for less than it would be found by: a ramp whose commands came a millisecond late left a
coupling of 3.8 sigma beside the lag that had taken all of its thousand. And a term of many values can be like much: a
heating of winding and magnet stood for a winding loss, with a stand of 0.6 Hz the model was full, and something was
left at 38 sigma.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import fit_without
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.select.forward_selection import Selected, Thruster, onwards
from identification.mismatch.select.search_again import missed
from identification.mismatch.select.stage import exchange_rivals
from identification.physics.term import Term

NO_EFFECTS = "whether effects tell what the measured rate shows"
NO_OTHER_BEGINNING = "whether effects tell it all without what was taken first and is doubtful now"


def begun_otherwise(found: Selected, rng: np.random.Generator, watch: Observer = UNWATCHED) -> Selected:
    """The model of a search without what was overtaken or has values that are not possible, then of one without terms
    of many values if something is left beside them, then of one without a term that follows the rate, where there are
    such and that model is better, or the same less what none would find; else as found."""
    told = _searched_without({*overtaken(found), *_impossible(found)}, NO_OTHER_BEGINNING, found, rng, watch)
    told = _searched_without(_many_sided(told, rng), NO_OTHER_BEGINNING, told, rng, watch)
    return _searched_without(_followers(told), NO_EFFECTS, told, rng, watch)


def _followers(found: Selected) -> list[Term]:
    return [term for term in found.after.fit.model.terms if term.traits.follows_rate]


def _many_sided(found: Selected, rng: np.random.Generator) -> list[Term]:
    """Terms of many values beside which something is left that no other term may take; none where nothing is."""
    now, system = found.after, Thruster(found.data, found.terms)
    many = [term for term, values in now.fit.values.items() if len(values) >= policy.select.MANY_SIDED]
    if not many or found.undone:
        return []
    last = system.judged(now, rng) if found.last is None else found.last
    return many if last.largest > last.threshold else []


def _impossible(found: Selected) -> list[Term]:
    system = Thruster(found.data, found.terms)
    return [term for term in found.after.fit.model.terms if system.impossible(found.after, term)]


def overtaken(found: Selected) -> list[Term]:
    """Terms without which the model would lose but a small part of what they gained when they were taken: since then
    others tell it."""
    now, gained = found.after, gains(found)
    return [
        term
        for term in now.fit.model.terms
        if term in gained
        and fit_without(now, term, found.data).chi2 - now.fit.chi2 < policy.select.OVERTAKEN * gained[term]
    ]


def gains(found: Selected) -> dict[Term, float]:
    """Fall of chi-square by each term when a round took it."""
    return {
        each.term: each.chi2_gain
        for round_ in found.rounds
        for each in round_.fitted
        if round_.after is not None and each.term in round_.after and each.term not in round_.model
    }


def _searched_without(
    terms: Collection[Term], unasked: str, found: Selected, rng: np.random.Generator, watch: Observer
) -> Selected:
    if not terms or found.undone:
        return found
    watch.stage("asking whether another beginning leads farther")
    effects = {term.id for term in terms}
    others = tuple(term for term in found.terms if term.id not in effects)
    other = onwards(found.data, others, found.before, found.before, rng, watch)
    other = exchange_rivals(other, rng, watch)
    if other.undone:
        return replace(found, undone=(*found.undone, unasked))
    if not (_better(other, found) or _no_worse_without(other, found, rng)):
        return found
    return replace(other, terms=found.terms, rounds=(*found.rounds, *other.rounds))


def _better(other: Selected, found: Selected) -> bool:
    """Whether its model has the smaller BIC, by the noise that suits the model that was found."""
    if not other.after.fit.model.terms:
        return False
    fitted = fit(other.after.fit.model, other.after.fit.theta, found.data, found.after.weights)
    return replace(found.after, fit=fitted).bic < found.after.bic


def _no_worse_without(other: Selected, found: Selected, rng: np.random.Generator) -> bool:
    """Whether it is the model found without terms that are worth little, and that no search would find beside it: they
    stand there because they came first."""
    less, whole = other.after, found.after
    if not set() < set(less.fit.model.terms) < set(whole.fit.model.terms):
        return False
    fitted = fit(less.fit.model, less.fit.theta, found.data, whole.weights)
    if fitted.chi2 - whole.fit.chi2 > policy.select.FIRST_COME_CHI2:
        return False
    return not missed(found.data, whole, less, Thruster(found.data, found.terms).judged(less, rng))
