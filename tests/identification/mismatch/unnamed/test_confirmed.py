"""A name that was earned beside terms without one is asked again where it is told."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identification.mismatch.name.naming import name
from identification.mismatch.unnamed.confirmed import BOUND, OTHER, WORSE, not_standing
from identification.mismatch.unnamed.shares import scores_alone
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.train_test_split import train_test_split
from identification.physics.dead_band import DeadBand
from identification.physics.exponent import Exponent
from tests.identification.diagnosed_runs import dead_band
from tests.identification.mismatch.small import known_noise, short

BAND = DeadBand()
ALIKE = Score(1.0, 100.0)


@pytest.fixture(scope="module")
def made():
    """A dead band of 1.2 V, named, and the scale of its run."""
    data, estimate = known_noise({BAND: (1.2,)}, [short(volts=dead_band(1.2))])
    (named,) = name(estimate, data, [])
    return named, data, estimate


def told_at(named, value, std=0.02):
    return replace(named, theta=(value,), std=(std,))


def failing(named, told, data, without=ALIKE):
    return {t: c.failed for t, c in not_standing([named], [told], data.scale, (ALIKE, {BAND: without})).items()}


def test_a_name_with_the_same_value_that_predicts_stands(made):
    named, data, _ = made
    assert failing(named, told_at(named, 1.0), data, Score(1.5, 200.0)) == {}


def test_a_name_whose_amount_is_another_by_half_does_not_stand(made):
    named, data, _ = made
    assert failing(named, told_at(named, 0.5), data) == {BAND: OTHER}
    assert failing(named, told_at(named, 2.6), data) == {BAND: OTHER}
    assert failing(named, told_at(named, 0.5, std=0.3), data) == {}, "within three of its errors it may be the same"


def test_an_amount_is_counted_from_where_the_effect_is_absent():
    """An exponent of 0.71 that is told as 1.37 is half of what was left out, not twice as much of it."""
    data, estimate = known_noise({Exponent(): (1.5,)}, [short()])
    (named,) = name(estimate, data, [])
    was, now = (replace(named, theta=(p,), std=(0.05,)) for p in (0.71, 1.37))
    assert [c.failed for c in not_standing([was], [now], data.scale, (ALIKE, {Exponent(): ALIKE})).values()] == [OTHER]
    near = replace(was, theta=(0.9,))
    assert not_standing([was], [near], data.scale, (ALIKE, {Exponent(): ALIKE})) == {}


def test_a_name_at_the_end_of_what_is_possible_does_not_stand(made):
    named, data, _ = made
    most = BAND.parameters(data.scale)[0].high
    assert failing(named, told_at(named, most), data) == {BAND: BOUND}


def test_a_name_without_which_the_rest_is_predicted_better_does_not_stand(made):
    named, data, _ = made
    assert failing(named, told_at(named, 1.2), data, Score(0.9, 90.0)) == {BAND: WORSE}
    assert failing(named, told_at(named, 1.2), data, Score(0.9, 92.0)) == {}, "that is chance"


def test_scores_of_the_names_alone_are_those_of_the_model_without_the_others(made):
    named, data, estimate = made
    split = train_test_split(estimate, data, ())
    whole, less = scores_alone(split, [named], [])
    assert whole.rmse < less[BAND].rmse
    nothing, _ = scores_alone(split, [], [BAND])
    assert nothing.rmse == pytest.approx(less[BAND].rmse)
