"""A second search of runs that are no longer quite the same: what is large stays, what was made up goes."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import fit
from identification.mismatch.select.screening import Directions, Screening
from identification.mismatch.select.search_again import missed, search_again
from identification.physics.dead_band import DeadBand
from identification.physics.zero_drift import ZeroDrift
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import history, rng, selected, short

BAND = DeadBand("shrink")
DRIFT = ZeroDrift("linear")


def drifting(t, _V, F):
    return F + 0.01 * t


def test_what_the_runs_no_longer_show_goes_and_what_they_show_stays():
    found = selected({BAND: (0.8,), DRIFT: (0.8,)}, [short(drifting, volts=dead_band(0.8))])
    assert set(found.after.fit.values) == {BAND, DRIFT}
    again = search_again(found, [history(short(volts=dead_band(0.8)))], rng())
    assert list(again.after.fit.values) == [BAND]
    assert again.rounds[0].model == (BAND,), "it was not searched from nothing"
    assert again.before.fit.values == {}


def test_from_nothing_where_hardly_anything_was_found():
    banded = short(volts=dead_band(0.8))
    for values in ({}, {BAND: (0.8,)}):
        again = search_again(selected(values, [banded]), [history(banded)], rng())
        assert again.rounds[0].model == ()
        assert list(again.after.fit.values) == [BAND]


@pytest.mark.parametrize(("largest", "goes"), [(3.9, False), (3.7, True)])
def test_what_is_nearly_found_without_a_term_keeps_it(largest, goes):
    """The threshold is a quantile of a few hundred surrogates: last digits of another computer move it by a few per
    cent, and with it went a term whose chi-square was 12."""
    found = selected({BAND: (0.8,), DRIFT: (0.0,)}, [short(volts=dead_band(0.8))])
    whole = found.after
    less = replace(whole, fit=fit(*whole.fit.less(DRIFT), found.data, whole.weights))
    nothing = Directions((), (), (), np.empty((0, 0)), np.empty(0))
    judged = Screening(nothing, np.array([largest]), np.array([largest]), 0.02, 4.0)
    assert missed(found.data, whole, less, judged) is not goes
