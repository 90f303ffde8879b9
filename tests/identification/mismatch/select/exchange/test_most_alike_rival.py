"""The rival that is most alike is refitted though its trials promise little; one that is less so is not."""

import numpy as np

from identification.mismatch.estimate.estimate import fit_without
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
