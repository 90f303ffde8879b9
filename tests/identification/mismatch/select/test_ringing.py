"""Stands that ring on for periods are sought when no line is left that one could be taken for."""

import numpy as np
import pytest

from identification.mismatch.observer import UNWATCHED
from identification.mismatch.select.ringing import ringing
from identification.physics.stand_resonance import StandResonance
from tests.identification.diagnosed_runs import NOISE
from tests.identification.mismatch.small import rng, selected, short

RING = StandResonance()
HERTZ, DAMPING = 31.7, 0.02


def rung(t, _V, F):
    """A tenth of each step rings."""
    w = 2 * np.pi * HERTZ
    at = np.flatnonzero(np.diff(F) != 0) + 1
    since = t[:, None] - t[at]
    wave = np.exp(-DAMPING * w * np.maximum(since, 0.0)) * np.cos(w * since) * (since >= 0)
    return F - 0.1 * wave @ (F[at] - F[at - 1])


def test_a_stand_between_the_trials_is_found_and_a_silent_one_is_not():
    found = selected({}, [short(rung, rate=100.0, seconds=60.0, noise=NOISE)], [RING])
    told = ringing(found, rng(), UNWATCHED)
    ((term, (_, frequency, damping)),) = told.after.fit.values.items()
    assert term.id == "stand_resonance"
    assert (frequency, damping) == (pytest.approx(HERTZ, rel=0.03), pytest.approx(DAMPING, rel=0.3))
    still = selected({}, [short(rate=100.0, seconds=60.0, noise=NOISE)], [RING])
    assert ringing(still, rng(), UNWATCHED) is still


def test_one_that_is_known_is_not_sought_again():
    found = selected({RING: (1.0, HERTZ, DAMPING)}, [short(rung, rate=100.0, seconds=60.0, noise=NOISE)], [RING])
    assert ringing(found, rng(), UNWATCHED) is found
