"""What a run will tell: the model's terms, the noise of a hold, the promise, the order."""

import numpy as np
import pytest

from identification.estimation.regression import Deficiency
from identification.experiment_design.experiment import Candidates, Design, optimal_levels
from identification.experiment_design.run_order import (
    Course,
    Setting,
    Slow,
    best_order,
    exposure,
    heat_state,
    schedule,
    spread_out,
)
from identification.experiment_design.thrust_design import Means, Noise, Promise, Terms, noise_of, noticed, promise

COURSE = Course(12.0, 4, 1.0, 3.0, 0.8)
V = np.array([20.0, -20.0, 10.0, -10.0, 5.0, -5.0, 20.0, -20.0])


def test_names_units_and_rows_of_every_term():
    terms = Terms(0.4, two_sided=True, linear=True, dead_band=1.0)
    assert terms.names == ("C_plus", "C_minus", "k", "dead_band", "tare")
    assert terms.units == ("N/V^2", "N/V^2", "N/V", "V", "N")
    assert terms.rows(np.array([3.0, -3.0, 0.5])).tolist() == [
        [4.0, 0.0, 3.0, -1.6, 1.0],
        [0.0, -4.0, -3.0, 1.6, 1.0],
        [0.0, 0.0, 0.5, 0.0, 1.0],
    ]
    assert terms.size(3.0) == pytest.approx([0.4, 0.4, 1.6 / 3, 3.0, np.inf])


def test_the_dead_band_column_is_the_derivative():
    volts, step = np.array([-8.0, 2.0, 15.0]), 1e-6
    change = Terms(0.4, dead_band=0.9 + step).thrust(volts) - Terms(0.4, dead_band=0.9 - step).thrust(volts)
    assert Terms(0.4, dead_band=0.9).rows(volts)[:, 1] == pytest.approx(change / (2 * step), rel=1e-6)


def test_noise_that_does_not_grow_with_thrust():
    found = noise_of(np.full(5, 0.1), np.full(5, 4.0), np.array([0.0, 1.0, 10.0, 50.0, 100.0]), 0.02)
    assert (found.white, found.proportional, found.floor) == (pytest.approx(0.2), pytest.approx(0.0), 0.02)


def test_noise_from_one_level_far_from_rest_is_never_nothing():
    assert noise_of(np.array([0.1]), np.array([1.0]), np.array([50.0]), 0.0).white > 0


def test_promise_is_the_scatter_of_weighted_fits():
    means, _ = schedule(V, np.full(8, 4.0), COURSE)
    terms, noise = Terms(0.4, two_sided=True), Noise(0.2, 0.01, 0.05)
    found = promise(means, terms, noise)
    assert isinstance(found, Promise)
    rng = np.random.default_rng(3)
    drawn = rng.standard_normal((4000, means.voltage.size))
    W = 1 / found.std_error
    fits = np.linalg.lstsq(found.rows * W[:, None], drawn.T, rcond=None)[0]
    assert fits.std(axis=1) == pytest.approx(found.std, rel=0.05)


def test_what_a_run_cannot_tell_is_named():
    means, _ = schedule(np.array([5.0, 10.0]), np.full(2, 4.0), COURSE)
    found = promise(means, Terms(two_sided=True), Noise(1.0))
    assert isinstance(found, Deficiency)
    assert "C_minus" in found.statement


def test_a_noticed_deviation_is_noticed_as_often_as_said():
    means, _ = schedule(V, np.full(8, 4.0), COURSE)
    found = promise(means, Terms(0.4), Noise(0.2))
    assert isinstance(found, Promise)
    size = float(noticed(found, np.array([10.0]), means.voltage)[0])
    shift = size * (means.voltage == 10.0) / found.std_error
    H = found.rows / found.std_error[:, None]
    left = np.eye(len(H)) - H @ found.cov @ H.T
    e = np.random.default_rng(4).standard_normal((len(H), 20_000)) + shift[:, None]
    direction = left @ (means.voltage == 10.0) / found.std_error
    statistic = direction @ e / np.linalg.norm(left @ direction)
    assert np.mean(np.abs(statistic) > 1.96) == pytest.approx(0.8, abs=0.01)


def test_a_level_that_the_model_bends_itself_to_notices_nothing():
    means = Means(np.array([0.0, 10.0]), np.ones(2), np.arange(2.0))
    found = promise(means, Terms(), Noise(1.0))
    assert isinstance(found, Promise)
    assert noticed(found, np.array([10.0]), means.voltage).tolist() == [np.inf]


def test_heat_rises_to_that_of_the_level_held():
    means = Means(np.full(200, 10.0), np.full(200, 1.0), np.arange(200.0) * 5)
    state = heat_state(means, 20.0, 60.0)
    assert state[0] == 0.0
    assert np.all(np.diff(state) >= 0)
    assert state[-1] == pytest.approx(1 / 16, rel=1e-3)


def straight(levels, dwells):
    means, total = schedule(levels, dwells, COURSE)
    return exposure(means, Terms(0.4), Noise(0.2), Slow(0.2), 20.0, total)


def test_staircase_takes_drift_for_C_and_a_searched_order_does_not():
    levels, dwells = np.sort(np.repeat([-20.0, -10.0, 10.0, 20.0], 4)), np.full(16, 4.0)
    setting = Setting(COURSE, Terms(0.4), Noise(0.2), 20.0, Slow(0.2))
    order = best_order(levels, dwells, setting, 300, np.random.default_rng(0))
    assert straight(levels[order], dwells).drift < 0.05 * straight(levels, dwells).drift
    assert abs(straight(levels[order], dwells).per_drift[0]) < 0.2 * abs(straight(levels, dwells).per_drift[0])


def test_straight_drift_moves_the_fit_as_said():
    levels, dwells = np.sort(np.repeat([-20.0, 10.0], 4)), np.full(8, 4.0)
    means, total = schedule(levels, dwells, COURSE)
    error = Noise(0.2).std(0 * means.voltage, means.seconds)
    H = Terms().rows(means.voltage) / error[:, None]
    moved = np.linalg.lstsq(H, (means.at / total - 0.5) / error, rcond=None)[0]
    assert straight(levels, dwells).per_drift == pytest.approx(moved)


def test_spread_out_without_zero_returns_is_one_way_up():
    assert spread_out(np.array([-5.0, 5.0]), np.array([1, 2]), 0).tolist() == [-5.0, 5.0, 5.0]


def test_information_in_hand_moves_the_time_elsewhere():
    rows = Candidates(np.array([0.0, 1.0]), np.array([[0.0, 1.0], [1.0, 1.0]]), ("a", "tare"))
    alone = optimal_levels(rows, 10.0, "A")
    tared = optimal_levels(rows, 10.0, "A", prior=np.diag([0.0, 1e6]))
    assert isinstance(alone, Design)
    assert isinstance(tared, Design)
    assert 0.0 in alone.levels.tolist()
    assert tared.levels.tolist() == [1.0]
    assert tared.std[0] == pytest.approx(np.sqrt(0.1), rel=1e-3)
