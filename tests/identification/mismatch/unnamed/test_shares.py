"""Names that are mostly right, and what each effect is of what any shape could explain."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import fit
from identification.mismatch.name.naming import Check, name
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.unnamed.shares import (
    mended,
    mostly_right,
    nearly_right,
    needed,
    only_repairs,
    scores_alone,
    share,
    with_shares,
)
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.train_test_split import train_test_split
from identification.physics.asymmetry import Asymmetry
from identification.physics.dead_band import DeadBand
from tests.identification.diagnosed_runs import NOISE, dead_band, run
from tests.identification.mismatch.pipeline.whole_diagnoses import diagnosed
from tests.identification.mismatch.small import known_noise, rng, short


def lumpy(_t, V, F):
    """Beside whatever else: a twentieth of a tent between 5 and 9 V, in one direction, which no textbook has."""
    return F + 1.2 * np.maximum(1 - np.abs(V - 7.0) / 2.0, 0.0)


@pytest.mark.parametrize(
    ("without", "with_it", "least", "expected"),
    [(2.0, 1.0, 1.0, 1.0), (2.0, 2.0, 1.0, 0.0), (2.0, 2.5, 1.0, 0.0), (1.0, 1.0, 1.0, 0.0), (5.0, 4.0, 3.0, 9 / 16)],
)
def test_a_share_is_of_the_squared_error_that_could_be_taken_off(without, with_it, least, expected):
    assert share(Score(without, 0.0), Score(with_it, 0.0), least) == pytest.approx(expected)


def test_what_is_explained_whole_is_all_of_it():
    found = diagnosed(run(volts=dead_band(1.0)))
    (one,) = found.findings
    assert (one.effect, one.grade, one.doubts) == ("dead_band", "all", ())
    without, with_it = one.heldout
    assert with_it < without
    assert one.share == pytest.approx(1.0)


def test_a_name_beside_a_lump_is_said_and_what_is_left_stands_beside_it():
    found = diagnosed(run(change=lumpy, volts=dead_band(1.2)))
    assert found.verdict == "unexplained"
    (band,) = [f for f in found.findings if f.effect == "dead_band"]
    assert band.parameters["half_width"].value == pytest.approx(1.2, abs=0.12)
    assert 0.8 < band.share <= 1.0
    assert found.unexplained is not None
    assert found.heldout.after < 0.5 * found.heldout.before


def doubted(checks, widths=(1.2, 0.7)):
    """Dead band and asymmetry, both right, but each with a check that it is said to have failed; and the judge."""
    made = short(change=lambda _t, V, F: np.where(V < 0, widths[1], 1.0) * F, volts=dead_band(widths[0]))
    data, estimate = known_noise({DeadBand(): (widths[0],), Asymmetry(): (widths[1],)}, [made])
    named = [
        n.asked(Check(kind, "its shape", "so it is said"))
        for n, kind in zip(name(estimate, data, []), checks, strict=True)
    ]
    return train_test_split(estimate, data, ()), named


def behind_slow_noise(half_width):
    """A dead band beside 1 N that wanders in tens of seconds, its noise known; and the judge."""
    places = np.arange(0.0, 81.0)
    wandering = np.interp(places, np.linspace(0.0, 80.0, 8), 2.0 * rng(0).standard_normal(8))
    made = short(lambda t, _V, F: F + np.interp(t, places, wandering), volts=dead_band(half_width))
    data, estimate = known_noise({DeadBand(): (half_width,)}, [made])
    heard = replace(estimate, noise=Noise(NOISE**2, 0.0, scales=(20.0,), slow=(4.0,)))
    return train_test_split(heard, data, ()), name(heard, data, [])


SHAPE = "own_covariate"


def test_names_of_which_none_makes_most_of_it_alone_are_said_together():
    split, named = doubted((SHAPE, SHAPE))
    best = split.judge(split.estimate.fit).rmse
    for n in named:
        assert mostly_right(split, [n], 0.9 * best).right == (n,)  # the other one stands as if it were earned
    found = mostly_right(split, named, best)
    assert {n.term.id for n in found.right} == {"dead_band", "asymmetry"}
    first = fit(*split.estimate.fit.less(Asymmetry()), split.data, split.estimate.weights)
    bare = fit(*split.estimate.fit.less(DeadBand(), Asymmetry()), split.data, split.estimate.weights)
    assert share(split.judge(bare), split.judge(first), best) < 0.8


def test_a_name_that_takes_nothing_off_beside_the_others_is_not_needed():
    made = short(volts=dead_band(1.0))
    data, estimate = known_noise({DeadBand(): (1.0,), Asymmetry(): (1.01,)}, [made])
    split = train_test_split(estimate, data, ())
    named = name(estimate, data, [])
    score, without = scores_alone(split, named, [])
    assert without[Asymmetry()].rmse < score.rmse  # so it is by chance
    assert [n.term for n in needed(split, named, named)] == [DeadBand()]


@pytest.mark.parametrize(("half_width", "tells"), [(0.2, True), (0.06, False)])
def test_a_name_that_slow_noise_hides_has_no_share(half_width, tells):
    """Beside 1 N that wanders it takes nothing off the error, which is no share of 0 % where it is plain without."""
    split, named = behind_slow_noise(half_width)
    score, without = scores_alone(split, named, [])
    (one,) = with_shares(split, named, [], score.rmse, same_run=True)
    assert without[DeadBand()].rmse < score.rmse
    assert (one.attained is None) == tells


def test_what_makes_too_little_even_together_is_not_said():
    split, named = doubted((SHAPE, SHAPE))
    best = 0.1 * split.judge(split.estimate.fit).rmse
    bare = fit(*split.estimate.fit.less(DeadBand(), Asymmetry()), split.data, split.estimate.weights)
    most = share(split.judge(bare), split.judge(split.estimate.fit), best)
    assert bool(mostly_right(split, named, best).right) is (most >= 0.8)


def test_of_two_shapes_that_repair_each_other_one_is_said():
    split, named = doubted(("repair", "repair"))
    found = mostly_right(split, named, split.judge(split.estimate.fit).rmse)
    assert len(found.right) <= 1
    assert only_repairs(named) == tuple(named)
    assert only_repairs([n.asked(Check("possible", "its values", "no")) for n in named]) == ()


def test_of_shapes_that_with_others_make_any_curve_each_may_still_be_asked_what_it_makes():
    _, named = doubted(("any_curve", "any_curve"))
    assert nearly_right(named) == tuple(named)
    assert all(mended(n) for n in named), "its value means something without the others alone"
    assert nearly_right([n.asked(Check("possible", "its values", "no")) for n in named]) == ()
    _, named = doubted((SHAPE, SHAPE))
    assert nearly_right(named) == ()
    assert not any(mended(n) for n in named)
    _, named = doubted(("constant", "any_curve"))
    assert nearly_right(named) == tuple(named)
