"""The search on runs that are no longer quite the same, begun with what is left there of the model found before.

A line in the spectrum, or a peak of the noise, hides small terms and makes up others; what is large beside it stays.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.data import Data
from identification.mismatch.observer import UNWATCHED, Interrupted, Observer
from identification.mismatch.select.forward_selection import (
    NOT_ALL,
    Given,
    Selected,
    Thruster,
    beginning,
    onwards,
)
from identification.mismatch.select.hidden import taken_by_noise
from identification.mismatch.select.screening import Screening
from identification.mismatch.select.stepwise import asked_again
from identification.run_history.history import History


def search_again(
    found: Selected,
    histories: Sequence[History],
    rng: np.random.Generator,
    given: Given | None = None,
    bands: tuple[tuple[float, float], ...] = (),
    without: Collection[str] = (),
    watch: Observer = UNWATCHED,
) -> Selected:
    """As `search`, of `histories` with noise that has `bands`, from what still earns its place of the model `found`."""
    data, terms, before = beginning(histories, given, bands, without)
    try:
        kept = _kept(Thruster(data, terms, watch), before, found.after.fit, rng)
    except Interrupted:
        return Selected(data, terms, before, before, (), None, undone=(NOT_ALL,))
    return onwards(data, terms, before, kept, rng, watch)


def _kept(system: Thruster, before: Estimate, model: Fit, rng: np.random.Generator) -> Estimate:
    """The model, fitted anew, without what a first round of these runs would not have let in. A single term is found
    again as quickly as it is asked."""
    if len(model.values) < 2:
        return before
    begun = system.enlarged(before, fit(model.model, model.theta, system.data, before.weights))
    return asked_again(system, begun, partial(missed, system.data), rng)


def missed(data: Data, whole: Estimate, less: Estimate, judged: Screening) -> bool:
    """Whether a screening without a term nearly finds something, or the noise had to take what the term did."""
    return judged.largest > policy.select.STILL_FOUND * judged.threshold or taken_by_noise(whole, less, judged, data)
