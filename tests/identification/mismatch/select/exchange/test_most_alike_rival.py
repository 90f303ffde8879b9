"""Which rivals are refitted, and how far: the most alike, and those that are stated to their end."""

import numpy as np
import pytest

from identification.mismatch.estimate.estimate import fit_without
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.select.exchange import rivals
from identification.mismatch.select.exchange.likeness import alike, worth_refitting
from identification.mismatch.select.exchange.rivals import FIRST_LIKENESS, swaps
from tests.identification.mismatch.small import known_noise, short
from tests.identification.physics.one_term import term

BENT, LINEAR, BAND = term("load_cell_nonlinearity", "cubic"), term("linear_term"), term("dead_band", "shrink")
WEAK, LAG = term("asymmetry"), term("motor_lag", "quadratic")


def asked(named, amount, change, *others):
    """How like the first of the others is and whether its trials promise anything, and which were refitted."""
    data, estimate = known_noise({named: (amount,)}, [short(change)])
    less = fit_without(estimate, named, data)
    like, _ = alike(estimate, named, less, data, [named, *others])[others[0]]
    promised = worth_refitting(like, less.chi2 - estimate.fit.chi2)
    return like, promised, [r.term for r in swaps(estimate, named, less, data, [named, *others])]


def bent(t, V, F):
    return F * (1 + 2e-5 * F**2)


def test_the_most_alike_is_refitted_however_little_its_trials_promise():
    like, promised, refitted = asked(BENT, 2e-5, bent, LINEAR)
    assert FIRST_LIKENESS < like < 0.9
    assert not promised
    assert refitted == [LINEAR]


def test_the_next_is_not():
    assert asked(BENT, 2e-5, bent, LINEAR, BAND)[2] == [BAND]


def test_nor_is_one_that_is_hardly_alike():
    like, promised, refitted = asked(WEAK, 0.9, lambda t, V, F: np.where(V < 0, 0.9 * F, F), LAG)
    assert 0.3 < like < FIRST_LIKENESS
    assert (promised, refitted) == (False, [])


def test_a_rival_that_is_stated_is_told_at_its_best_however_slow_its_way(monkeypatch):
    monkeypatch.setattr(rivals, "RIVAL_STEPS", 1)
    data, estimate = known_noise({BENT: (2e-5,)}, [short(bent, noise=5.0)], 5.0)
    (rival,) = swaps(estimate, BENT, fit_without(estimate, BENT, data), data, [BENT, LINEAR])
    best = fit(rival.fit.model, rival.fit.theta, data, estimate.weights)
    assert rival.fit.chi2 == pytest.approx(best.chi2, abs=0.02)
    assert rival.bic_loss == pytest.approx(best.chi2 - estimate.fit.chi2, abs=0.02)
