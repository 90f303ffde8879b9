"""A second search where thrust was found to follow the measured rate: can effects tell it without?

Whatever a drive does before the rotor, the rate shows. One term that follows it takes all of that at once, and no
search asks any more which effects they are: a winding loss beside a dead band was told as a drive that saturates, a
coupling for the rest, and C far off. Models are sought once more without it; the better of the two is kept.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.fitting import fit
from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.select.forward_selection import Selected, onwards
from identification.mismatch.select.stage import exchange_rivals

NO_EFFECTS = "whether effects tell what the measured rate shows"


def told_without_the_rate(found: Selected, rng: np.random.Generator, watch: Observer = UNWATCHED) -> Selected:
    """The model without a term that follows the rate, where one was found and that model is better; else as found."""
    followers = [term for term in found.after.fit.model.terms if term.traits.follows_rate]
    if not followers or found.undone:
        return found
    watch.stage("asking whether effects tell what the rate shows")
    others = tuple(term for term in found.terms if not term.traits.follows_rate)
    other = onwards(found.data, others, found.before, found.before, rng, watch)
    other = exchange_rivals(other, rng, watch)
    if other.undone:
        return replace(found, undone=(*found.undone, NO_EFFECTS))
    if not _better(other, found):
        return found
    return replace(other, terms=found.terms, rounds=(*found.rounds, *other.rounds))


def _better(other: Selected, found: Selected) -> bool:
    """Whether its model has the smaller BIC, by the noise that suits the model that was found."""
    if not other.after.fit.model.terms:
        return False
    fitted = fit(other.after.fit.model, other.after.fit.theta, found.data, found.after.weights)
    return replace(found.after, fit=fitted).bic < found.after.bic
