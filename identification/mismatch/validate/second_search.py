"""The search gone on with where what was not fitted refuses a term: without it, from what is left of the model.

A term that came early, and that another run refuses, keeps out what should stand in its place, and bends the values of
what stands beside it. Which of several models that are nearly as good is reached first is decided by the last digits of
sums; which of them predicts is not.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.select.forward_selection import Selected, resumed
from identification.mismatch.select.stage import exchange_rivals
from identification.mismatch.validate.judged import HeldBack, Judged, judged
from identification.mismatch.validate.refuted import refuted, without_refuted
from identification.mismatch.validate.train_test_split import TrainTestSplit, better
from identification.physics.term import Term

SEARCHES = 2
"""Times that the search goes on: each costs as much as a search from the baseline."""


def without_what_is_refused(
    first: Judged, held_back: HeldBack, rng: np.random.Generator, watch: Observer = UNWATCHED
) -> Judged:
    """The judged model that predicts what was not fitted best: the first, or what the search finds from it on without
    the terms that are refused there, and without those that then come and do not predict."""
    best, barred = first, frozenset[Term]()
    for _ in range(SEARCHES):
        gone = refuted(best.validated.split, best.validated.unearned, same_run=best.same_run)
        if best.selected.undone or not gone:
            break
        barred |= {n.term for n in gone}
        less, left = without_refuted(best.located.estimate, gone, best.selected.data, best.unseen)
        other = _gone_on(best.selected, less, barred, held_back, rng, watch)
        if other is None or other.unseen != best.unseen:
            break
        if _predicts_better(other, left):
            best = other
        else:
            barred |= set(other.located.estimate.fit.model.terms) - set(less.fit.model.terms)
    return best


def _gone_on(
    selected: Selected,
    less: Estimate,
    barred: Collection[Term],
    held_back: HeldBack,
    rng: np.random.Generator,
    watch: Observer,
) -> Judged | None:
    """What the search finds from the model `less` on; None where that is all it finds, or where it was interrupted."""
    begun = replace(selected, terms=tuple(t for t in selected.terms if t not in barred))
    found = resumed(begun, less, rng, watch)
    if found.undone or frozenset(found.after.fit.model.terms) == frozenset(less.fit.model.terms):
        return None
    found = exchange_rivals(found, rng, watch)
    return None if found.undone else judged(found, held_back, rng)


def _predicts_better(other: Judged, left: TrainTestSplit) -> bool:
    """Than what is left of the model, by the judge of that one."""
    new, old = other.validated.split.estimate.fit, left.estimate.fit
    return better(left.judge(new), left.judge(old), max(int(new.free.sum() - old.free.sum()), 0))
