"""The stage: runs in, the model that earns its terms out: forward selection, then rivals exchanged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.estimate import Estimate, fit_without
from identification.mismatch.observer import UNWATCHED, Interrupted, Observer
from identification.mismatch.select.exchange.aliases import within_samples
from identification.mismatch.select.forward_selection import Selected, SwapTest, Thruster, prune, resumed
from identification.mismatch.select.stepwise import exchanged
from identification.physics.term import Term

NO_RIVALS = "whether another effect would do as well as one that is named"


def exchange_rivals(found: Selected, rng: np.random.Generator, watch: Observer = UNWATCHED) -> Selected:
    """With rivals exchanged; and once more what lies beyond, where the exchange made another model of it.

    As found, no rival asked, where the search is or was interrupted.
    """
    if not found.after.fit.model.terms:
        return found
    try:
        return _unasked(found) if found.undone else _with_rivals(found, rng, watch)
    except Interrupted:
        return _unasked(found)


def _with_rivals(found: Selected, rng: np.random.Generator, watch: Observer) -> Selected:
    after, standing = _exchanged(found, watch)
    if frozenset(after.fit.model.terms) == frozenset(found.after.fit.model.terms):
        return _settled(found, after, standing)
    again = resumed(found, after, rng, watch)
    if again.undone:
        raise Interrupted
    if again.after is after:
        return _settled(found, after, standing)
    return _settled(again, *_exchanged(again, watch))


def _unasked(found: Selected) -> Selected:
    """As it is, with no rival of any of its terms."""
    standing: dict[Term, SwapTest] = {
        term: (fit_without(found.after, term, found.data), []) for term in found.after.fit.model.terms
    }
    return replace(found, standing=standing, undone=(*found.undone, NO_RIVALS))


def _settled(found: Selected, after: Estimate, standing: dict[Term, SwapTest] | None) -> Selected:
    last = found.last if after is found.after else None
    return replace(found, after=after, last=last, standing=standing)


def _exchanged(found: Selected, watch: Observer) -> tuple[Estimate, dict[Term, SwapTest] | None]:
    """With rivals exchanged, pruned as a search ends; as found where what was exchanged for a term is dropped again."""
    after, standing = exchanged(Thruster(found.data, found.terms, watch), found.after)
    slower = within_samples(after, found.data)
    if slower is not after:
        return slower, None
    if after is found.after:
        return after, standing
    pruned = prune(after, found.data)
    if pruned is after:
        return after, standing
    new = set(after.fit.model.terms) - set(found.after.fit.model.terms)
    return (pruned if new <= set(pruned.fit.model.terms) else found.after), None
