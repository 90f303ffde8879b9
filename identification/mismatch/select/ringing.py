"""The search gone on with for stands that ring on for periods, once no line is left in the runs.

A line that stays in phase with a step for some periods looks like such a ring, and a ring that was taken for it would
leave another line.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch.observer import UNWATCHED, Observer
from identification.mismatch.select.forward_selection import Selected, resumed


def ringing(found: Selected, rng: np.random.Generator, watch: Observer = UNWATCHED) -> Selected:
    """What was `found` where nothing rings, or where the ticks of the command have pointed to it already."""
    stands = {term.id for term in found.terms if term.traits.frequency}
    known = {term.id for term in found.after.fit.model.terms}
    if found.undone or found.after.weights.ticks or not stands - known:
        return found
    begun = replace(found, data=replace(found.data, rings=True))
    again = resumed(begun, found.after, rng, watch)
    return found if again.after is found.after else again
