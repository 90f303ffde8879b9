"""A threshold of a twin: how far it may be off, and that a level just beyond it turns the rotor whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.answer.against_twin import twin_of, with_twin
from identification.mismatch.compare.earlier_recordings import Later, put_to_earlier
from identification.mismatch.compare.saved_model_baseline import given, prior_factor, starting
from identification.mismatch.estimate.confidence_intervals import intervals
from identification.mismatch.estimate.estimate import refresh
from identification.mismatch.estimate.fit_covariance import covariance
from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Model, extended
from identification.mismatch.model.parameters import Theta
from identification.mismatch.pipeline import diagnose
from identification.mismatch.value import QUANTILE, Value
from identification.physics.dead_band import DeadBand
from identification.physics.motor_lag import MotorLag
from identification.recording import Channel, Recording
from tests.identification.mismatch.answer.answered import draft, finding
from tests.identification.mismatch.small import data_of, known_noise

C, HALF_WIDTH, HOLD = 0.5, 0.6, 1.0
JUMP, LAG = DeadBand("jump"), MotorLag("first_order")
LEVELS = np.array([0.0, 9.0, -0.45, 3.0, 0.8, -9.0, 0.45, -3.0, -0.8, 6.0])


def run(levels, seed, half_width=HALF_WIDTH):
    """S of every level, the rotor at once, 50 samples a second."""
    start = HOLD * np.arange(levels.size)
    t = np.arange(0.01, HOLD * levels.size, 0.02)
    V = levels[np.searchsorted(start, t, side="right") - 1]
    n = V * (np.abs(V) > half_width)
    rng = np.random.default_rng(seed)
    return Recording(
        f"r{seed}",
        "T1",
        (
            Channel("command_voltage", "command", "command_voltage", "V", start, levels),
            Channel("thrust", "cell", "thrust", "N", t, C * n * np.abs(n) + rng.normal(0, 0.01, t.size)),
        ),
    )


@pytest.fixture(scope="module")
def fitted():
    recording = run(np.tile(LEVELS, 4), 1)
    data, _ = data_of([recording])
    estimate = refresh(Model((JUMP,)), Theta(C, ((0.55,),), (0.0,)), data, None, None)
    return recording, data, estimate


def test_a_threshold_is_as_sure_as_its_levels_lie_apart(fitted):
    """Anywhere between 0.45 and 0.8 V does; the slope of a stair said 0 or 1e-15 V."""
    recording, data, estimate = fitted
    place = estimate.fit.layout.of(JUMP).start
    known = intervals(estimate.fit, data, estimate.weights, [JUMP])[JUMP][0]
    std = float(np.sqrt(covariance(estimate.fit, data, estimate.weights)[place, place]))
    value = estimate.fit.values[JUMP][0]
    assert std == pytest.approx(max(known.high - value, value - known.low) / QUANTILE)
    assert 0.05 < std < 0.2
    twin = twin_of(estimate, data, [recording], None)
    assert np.sqrt(twin.covariance[1][1]) == pytest.approx(std)
    assert twin.covariance[0][1] == 0.0


def test_a_level_between_those_of_the_twin_is_no_surprise(fitted):
    """At 0.58 V the rotor rests or turns: the twin cannot know, and says so of that level alone."""
    recording, data, estimate = fitted
    twin = twin_of(estimate, data, [recording], None)
    later, _ = data_of([run(np.tile(np.append(LEVELS, [0.58, -0.58]), 4), 2)])
    theta = Theta(twin.C, (), (0.0,))
    unsure = np.sqrt(np.sum(prior_factor(twin, later, theta).thrust[0] ** 2, axis=1))
    driver = np.abs(later.histories[0].driver[later.rows[0]])
    between = C * 0.58**2
    assert np.all(unsure[np.isclose(driver, 0.58)] > 0.3 * between)
    assert np.all(unsure[np.isclose(driver, 9.0)] < 0.1 * between)
    sure = replace(twin, covariance=tuple(map(tuple, np.diag([twin.covariance[0][0], 1e-30]).tolist())))
    less = np.sqrt(np.sum(prior_factor(sure, later, theta).thrust[0] ** 2, axis=1))
    assert np.all(less[np.isclose(driver, 0.58)] < 0.02 * between)


def test_a_level_just_beyond_a_given_threshold_turns_the_rotor_whole(fitted):
    """For a fit the jump is spread over 0.0018 V of 9: half of 0.6 V would turn it, of a threshold that is known."""
    recording, data, estimate = fitted
    twin = twin_of(estimate, data, [recording], None)
    (term,) = twin.terms
    at = replace(twin, terms=(replace(term, parameters={"half_width": 0.6}),))
    later, _ = data_of([run(np.tile([9.0, 0.6003, -9.0, -0.5997], 4), 3)])
    told, _ = raw(Model((), given(at)), Theta(C, (), (0.0,)), later, with_rate=False)
    driver = later.histories[0].driver[later.rows[0]]
    assert told[0][np.isclose(driver, 0.6003, rtol=1e-6)] == pytest.approx(C * 0.6003**2)
    assert told[0][np.isclose(driver, -0.5997, rtol=1e-6)] == pytest.approx(0.0, abs=1e-12)
    spread, _ = raw(Model((JUMP,)), Theta(C, ((0.6,),), (0.0,)), later, with_rate=False)
    assert np.all(spread[0][np.isclose(driver, 0.6003, rtol=1e-6)] < 0.8 * C * 0.6003**2)


@pytest.mark.parametrize(("half_width", "changed"), [(0.7, False), (0.2, True)])
def test_a_threshold_that_lies_where_earlier_levels_left_it_open_has_not_changed(fitted, half_width, changed):
    """ "Changed: within 0.43 V; the twin has 0.70 V", of which the twin knew that it is between 0.35 and 0.84."""
    recording, data, estimate = fitted
    twin = twin_of(estimate, data, [recording], None)
    second = run(np.tile([*LEVELS, 0.65, -0.65], 4), 6, half_width)
    data, theta, model = starting(twin)(*data_of([second]))
    found = refresh(*extended(model, theta, JUMP, (half_width,)), data, None, None)
    band = replace(finding(), form="jump", parameters={"half_width": Value(half_width, 0.02, "V")})
    told = with_twin(draft(findings=(band,)), found, data, [second], twin)
    assert [f.effect for f in told.findings] == ["dead_band"] * changed
    assert [note.startswith("Dead band. ") for note in told.notes] == [True] * (not changed)


def test_a_threshold_that_moved_across_levels_is_found_where_it_is_now():
    """A little more than 0.6 V changes nothing between two levels, and no slope leads to 0.73 V."""
    levels = np.concatenate([LEVELS, np.outer([0.57, 0.63, 0.67, 0.71, 0.75], [1, -1]).ravel()])
    first, second = run(np.tile(levels, 3), 4), run(np.tile(levels, 3), 5, half_width=0.73)
    yesterday = diagnose([first])
    assert [f.effect for f in yesterday.findings] == ["dead_band"]
    today = diagnose([second], baseline=yesterday.twin, before=[first])
    assert today.verdict == "explained"
    (moved,) = today.findings
    assert moved.effect == "dead_band"
    assert 0.71 < moved.parameters["half_width"].value < 0.75


def test_a_threshold_that_earlier_levels_passed_over_is_not_called_new():
    """Its jump is spread over 0.0018 V for the fit, which ends beside the true place: for certain there it is wrong."""
    far = np.array([0.0, 9.0, 3.0, -9.0, -3.0, 6.0])
    near = np.concatenate([far, np.repeat([0.5999, -0.5999], 24), [0.6002, -0.6002]])
    first, second = run(np.tile(far, 6), 8), run(np.tile(near, 2), 9)
    data, estimate = known_noise({}, [first])
    twin = twin_of(estimate, data, [first], None)
    data, theta, model = starting(twin)(*data_of([second]))
    found = refresh(*extended(model, theta, JUMP, (0.6,)), data, None, None)
    assert not 0.5999 < found.fit.values[JUMP][0] < 0.6002
    told, _ = put_to_earlier(twin, [first], Later([second], data, found), [JUMP])
    assert told[JUMP].since == "not shown before"


def test_what_has_no_stairs_keeps_its_covariance(fitted):
    _, data, _ = fitted
    estimate = refresh(Model((LAG,)), Theta(C, ((0.05,),), (0.0,)), data, None, None)
    told = covariance(estimate.fit, data, estimate.weights)
    assert told == pytest.approx(np.nan_to_num(estimate.fit.cov))
