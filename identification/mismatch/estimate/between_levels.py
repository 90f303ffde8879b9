"""A threshold of the command is sought between its levels by chi-square itself.

Wherever it lies between two levels it predicts the same, and a fit stays there: no slope leads past the next level,
which turns the rotor or does not.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, fit, residual_of
from identification.mismatch.estimate.others_follow import OthersFollow
from identification.mismatch.model.data import Data
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights
from identification.physics.term import Term
from identification.recording import Floats

FAR, PARTS, CLOSER = 1.3, 8, 3
"""How far from a threshold it is looked for, as a factor; in so many parts to each side; each once more so finely."""


def between_levels(found: Fit, data: Data, weights: Weights) -> Fit:
    """The fit, or the better one with a threshold elsewhere; as given where no term has one."""
    for term in found.model.terms:
        for j, known in enumerate(term.parameters(data.scale)):
            if known.jumps and known.blur > 0:
                begin = _least(found, data, weights, term, j)
                other = fit(found.model, begin, data, weights, near=found) if begin is not None else found
                found = min(found, other, key=lambda each: each.chi2)
    return found


def sought(value: float, most: float, chi2: Callable[[float], float]) -> float:
    """Where chi-square is least round `value`, no further than FAR times it and `most`."""
    far = FAR
    for _ in range(CLOSER):
        places = np.minimum(value * np.geomspace(1 / far, far, 2 * PARTS + 1), most).tolist()
        told = np.array([chi2(place) for place in places])
        value = _middle(np.array(places), told)
        far = far ** (1.5 / PARTS)
    return value


def _middle(places: Floats, told: Floats) -> float:
    """Of the places beside each other that are all the best: nothing tells one from the next."""
    best = int(np.argmin(told))
    same = told <= told[best] + policy.estimate.CLOCK_HOLLOW_CHI2
    first, last = best, best
    while first > 0 and same[first - 1]:
        first -= 1
    while last + 1 < same.size and same[last + 1]:
        last += 1
    return float(0.5 * (places[first] + places[last]))


def _least(found: Fit, data: Data, weights: Weights, term: Term, j: int) -> Theta | None:
    """Where chi-square is least over one threshold, all other values following it; None: where it is."""
    at = found.layout.of(term).start + j
    known = term.parameters(data.scale)[j]
    others = OthersFollow(found, at)

    def moved(value: float) -> Theta:
        vector = found.theta.vector
        vector[at] = value
        return found.theta.with_vector(vector)

    def left(value: float) -> Floats:
        return residual_of(found.model, moved(value), data, weights)

    value = float(found.theta.vector[at])
    best = sought(value, known.high, lambda place: others.chi2(left(place))) if value > 0 else value
    if not others.chi2(left(best)) < found.chi2 - policy.estimate.CLOCK_HOLLOW_CHI2:
        return None
    return found.theta.with_vector(others.taken_along(moved(best).vector, left(best)))
