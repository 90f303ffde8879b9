"""Recordings that a measured rotation rate drives: paired with the thrust of the same instants, its noise averaged."""

import numpy as np
import pytest

from identification.mismatch.pipeline import diagnose
from identification.mismatch.prepare.measured_driver import measured, noise_of
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import start
from identification.recording import Channel, Recording
from identification.run_history.filters import reconstructed

C, TOP, HOLD = 0.28, 19.2, 3.0
REVERSE = 0.893


def staircase(t, seed=6):
    """Levels of 3 s, reached between two samples."""
    levels = np.random.default_rng(seed).choice(np.linspace(-TOP, TOP, 9), 61)
    levels[0] = 0.0
    return levels[(t // HOLD).astype(int)]


def ramp(t):
    return TOP * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * t / 31.7))


def run(course=staircase, rate=20.0, noise=0.0, reverse=1.0, turning=None, offset=0.0, seconds=120.0, seed=1):
    """Thrust C n|n| at `rate` Hz, the rate of rotation at `turning` Hz (None: in the same rows); `noise` of that in
    rev/s."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, seconds, 1 / rate) + offset
    at = np.arange(0, seconds + 0.2, 1 / (turning or rate)) + (0.0 if turning else offset)
    n = course(t)
    thrust = np.where(n > 0, C, reverse * C) * n * np.abs(n) + 1.0 + 0.5 * rng.standard_normal(t.size)
    told = course(at) + noise * rng.standard_normal(at.size)
    channels = (
        Channel("n", "motor", "rotation_rate", "rev/s", at, told),
        Channel("F", "cell", "thrust", "N", t, thrust),
    )
    return Recording("turning", "T1", channels, source="turning.h5")


# ---------------------------------------------------------------- instants are paired


@pytest.mark.parametrize("rate", [10.0, 20.0, 100.0])
def test_thrust_and_rate_of_one_instant_are_paired_across_a_jump(rate):
    """A straight line between two levels was taken for the rate: the first thrust of each level was off by newtons."""
    history = history_of(run(rate=rate))
    assert history.count.sum() == history.thrust_samples.time.size == 120 * rate
    force = 0.28 * (history.driver * np.abs(history.driver) + 2 * np.abs(history.driver) * history.lead) + 1.0
    left = ((history.thrust - force) * np.sqrt(history.count))[history.rows]
    assert np.std(left) == pytest.approx(0.5, rel=0.1)
    assert np.max(np.abs(left)) < 2.5


def test_a_moving_driver_is_paired_sample_by_sample():
    history = history_of(run(lambda t: TOP * np.sin(1.9 * t), rate=10.0))
    line = history.driver * np.abs(history.driver)
    seen = reconstructed(line, history.middle, history.sampled)
    seen += 2 * np.abs(history.driver) * history.lead + history.curved
    assert np.std((history.thrust - C * seen - 1.0)[history.rows]) == pytest.approx(0.5, rel=0.1)


def test_thrust_between_two_samples_of_a_rate_that_jumps_is_not_judged():
    history = history_of(run(rate=100.0, turning=10.0, offset=0.003))
    levels = staircase(np.arange(0, 120, HOLD))
    jumped = HOLD * (1 + np.flatnonzero(np.diff(levels)))
    late = history.thrust_samples.time[:, None] - jumped
    assert not np.any((late > -0.09) & (late < -0.01))
    assert history.count.sum() > 0.9 * 12000


def test_a_jump_is_an_edge():
    held = measured(np.arange(8.0), np.array([0.0, 0.0, 0.0, 9.0, 9.0, 9.0, 8.9, 8.8]))
    assert held.jumps.tolist() == [2.5]
    assert held.at(np.array([2.4, 2.6])).tolist() == [0.0, 9.0]


# ---------------------------------------------------------------- its noise


def test_the_noise_of_a_driver_is_told_beside_steps_and_ramps():
    t = np.arange(0, 120, 0.05)
    noise = 0.1 * np.random.default_rng(2).standard_normal(t.size)
    for course in (staircase, ramp):
        assert noise_of(course(t) + noise) == pytest.approx(0.1, rel=0.1)


@pytest.mark.parametrize(("course", "most"), [(staircase, 0.2), (ramp, 0.45), (lambda t: TOP * np.sin(0.6 * t), 0.6)])
def test_the_noise_of_a_driver_is_averaged_and_its_course_kept(course, most):
    t = np.arange(0, 120, 0.05)
    told = course(t) + 0.1 * np.random.default_rng(3).standard_normal(t.size)
    smooth = measured(t, told)
    assert np.std(smooth.value - course(t)) < 0.1 * most
    assert np.max(np.abs(smooth.value - course(t))) < 0.4


def test_levels_share_the_error_of_their_mean():
    t = np.arange(0, 60, 0.05)
    told = staircase(t) + 0.1 * np.random.default_rng(4).standard_normal(t.size)
    smooth = measured(t, told)
    errors = [(np.mean(staircase(t)[v.first : v.last]) - v.value) / v.error for v in smooth.levels]
    assert len(errors) >= 14
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.5
    history = history_of(run(noise=0.1, seconds=60.0))
    data, _ = start([history])
    assert data.prior_factor is not None
    assert data.prior_factor.thrust[0].shape == (history.rows.size, history.level_errors.shape[1])


def test_a_driver_without_noise_is_left_as_it_is():
    t = np.arange(0, 30, 0.05)
    assert np.array_equal(measured(t, staircase(t)).value, staircase(t))


# ---------------------------------------------------------------- what is said


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"rate": 10.0},
        {"rate": 100.0, "turning": 10.0, "offset": 0.003},
        {"noise": 0.1},
        {"course": ramp, "rate": 50.0, "noise": 0.1},
    ],
    ids=["clean", "10 Hz", "rate more seldom", "noise", "noisy ramp"],
)
def test_nothing_is_missing_where_the_thrust_follows_the_rate(how):
    assert diagnose([run(**how)]).verdict == "adequate"


@pytest.mark.parametrize("how", [{}, {"rate": 10.0}, {"noise": 0.05}], ids=["20 Hz", "10 Hz", "noise"])
def test_an_asymmetry_is_named_and_its_value_known(how):
    found = diagnose([run(reverse=REVERSE, **how)])
    assert found.verdict in ("ambiguous", "explained")
    (one,) = found.findings
    assert {one.effect, *(r.effect for r in one.rivals)} == {"asymmetry", "torque_crosstalk"}
    if one.effect == "asymmetry":
        low, high = one.parameters["ratio"].interval
        assert low - 0.001 < REVERSE < high + 0.001
    assert found.next_experiment is None or found.next_experiment.quantity == "rotation_rate"
