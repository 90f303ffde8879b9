"""What bend dead weights leave a cell, and what a diagnosis makes of that."""

from dataclasses import replace

import numpy as np
import pytest

from identification.calibration.bend import CellBend, bend_left
from identification.calibration.curve import Curve
from identification.mismatch.pipeline import diagnose
from tests.identification.diagnosed_runs import run

REACH = 90.0


def curve(std, low=-REACH, high=REACH, correlation=0.0):
    """Straight within `std` (gain, even, odd, cubic); the bends F|F| and F^3 correlated."""
    cov = np.diag(np.square(std))
    cov[2, 3] = cov[3, 2] = correlation * std[2] * std[3]
    return Curve(0.0, (1.0, 0.0, 0.0, 0.0), tuple(map(tuple, cov.tolist())), low, high, 20.0)


STD = (1e-4, 2e-6, 3e-6, 4e-8)
FORCE = np.array([-80.0, 0.0, 80.0])


def test_what_is_known_of_each_bend():
    assert bend_left(curve(STD), FORCE) == pytest.approx(STD[1:])
    alone = np.sqrt(1 - 0.9**2)
    assert bend_left(curve(STD, correlation=-0.9), FORCE) == pytest.approx((2e-6, 3e-6 * alone, 4e-8 * alone))


def test_a_bend_that_was_not_told_from_another_is_as_uncertain_as_that():
    assert bend_left(curve((1e-4, 2e-6, 3e-6, 0.0)), FORCE) == pytest.approx((2e-6, 3e-6, 3e-6 / REACH))
    assert bend_left(curve((1e-4, 0.0, 0.0, 0.0)), FORCE) == CellBend()


@pytest.mark.parametrize(("low", "high"), [(0.0, REACH), (-REACH, 60.0), (-60.0, REACH)])
def test_weights_that_did_not_reach_so_far_tell_nothing(low, high):
    assert bend_left(curve(STD, low, high), FORCE) == CellBend()
    assert bend_left(None, FORCE) == CellBend()


def bent(known):
    """A thrust that grows less and less, in a recording whose cell was calibrated so."""
    made = run(lambda _t, V, _F: 0.5 * V * np.abs(V) * (1 - 1.7e-4 * V**2), seed=3, seconds=120.0, rate=20.0)
    if known is None:
        return made
    facts = {"curve": known.as_json()}
    return replace(
        made,
        channels=tuple(replace(c, calibration=facts) if c.quantity == "thrust" else c for c in made.channels),
    )


def said(recording):
    """Effects that are named or stand beside one as its rivals."""
    found = diagnose([recording])
    return {effect for f in found.findings for effect in (f.effect, *(rival.effect for rival in f.rivals))}


CELL = {"load_cell_nonlinearity", "load_cell_even_bend"}


def test_a_cell_that_weights_found_straight_is_no_rival_of_what_bends_the_thrust():
    assert said(bent(None)) & CELL
    told = said(bent(curve(STD)))
    assert told
    assert not told & CELL


def test_a_cell_that_weights_left_so_bent_may_be_it():
    assert said(bent(curve((1e-3, 3e-4, 3e-4, 3e-6)))) & CELL
