"""Structure that was planted is located over its covariate; noise, of any colour that is known, is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.locate.places import Place, locate, places_of, says
from identification.mismatch.locate.pulses import likeliest_pulses
from identification.mismatch.locate.residual_structure_test import residual_structure
from identification.mismatch.locate.slow_change import beside_slow_change, slow_changes, slow_columns
from identification.mismatch.locate.stage import run as locate_stage
from identification.mismatch.select.covariates import Covariate
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.screening import Directions, Screening
from identification.mismatch.value import Where
from identification.physics.dead_band import DeadBand
from identification.physics.zero_offset import ZeroOffset
from identification.recording import Channel
from tests.identification.diagnosed_runs import NOISE, C, dead_band, table
from tests.identification.mismatch.small import data_of, estimated, known_noise, rng, selected, short

ALARM = policy.locate.RESIDUAL_FALSE_ALARM
BAND = DeadBand()


def judged(recording, values=None, seed=0, std=NOISE):
    data, estimate = known_noise(values or {}, [recording], std)
    return data, estimate, residual_structure(estimate.fit, data, estimate.weights, rng(seed))


def water():
    t = np.arange(0.0, 80.0, 0.5)
    return Channel("w", "w", "water_temperature", "degC", t, 15 + 3 * np.sin(t / 5))


PLANTED = {
    "command_voltage": lambda t, V, F: F + 0.6 * (V == 8.0),
    "time": lambda t, V, F: F + 0.5 * np.sin(2 * np.pi * t / 40),
    "time_since_step": lambda t, V, F: F + 1.2 * np.sign(V) * np.exp(-((t - 0.0071) % 3.0) / 0.3),
    "water_temperature": lambda t, V, F: F + 0.2 * np.interp(t, water().time, water().value),
}


@pytest.mark.parametrize("quantity", PLANTED)
def test_what_is_planted_over_a_covariate_is_located_there(quantity):
    run = short(change=PLANTED[quantity], extra=(water(),))
    _, _, found = judged(run)
    assert found.p_value < ALARM
    assert found.groups[0].covariate.quantity == quantity
    assert found.groups[0].p_value < 1e-6
    assert 0 < found.groups[0].share < 1


def test_of_noise_p_values_are_not_smaller_than_they_say():
    """Twenty runs with nothing planted."""
    found = np.array([judged(short(seed=seed, seconds=40.0), seed=seed)[2].p_value for seed in range(20)])
    assert np.mean(found < 0.1) < 0.3
    assert np.mean(found < 0.5) < 0.8
    assert np.min(found) > 0.001


def regressed(data, fits, covariate):
    """(fall of chi-square, rank) of a regression of the whitened residual on a covariate's columns."""
    w = np.sqrt(data.histories[0].count[data.rows[0]]) / NOISE
    y = np.clip(fits.residual, -policy.locate.OUTLIER_SIGMA, policy.locate.OUTLIER_SIGMA)
    base = fits.jacobian / np.linalg.norm(fits.jacobian, axis=0)
    more = covariate.columns[0] * w[:, None]
    more = more[:, np.any(more, axis=0)]
    both = np.column_stack([base, more / np.linalg.norm(more, axis=0)])
    left = [y - X @ np.linalg.lstsq(X, y, rcond=1e-9)[0] for X in (base, both)]
    return float(left[0] @ left[0] - left[1] @ left[1]), np.linalg.matrix_rank(both, tol=1e-7) - base.shape[1]


@pytest.mark.parametrize("planted", [None, "time", "command_voltage"])
def test_a_group_is_the_size_of_the_residual_in_its_columns(planted):
    """Chi-square of a regression on them, beside what the model can follow."""
    data, estimate, found = judged(short(change=PLANTED.get(planted)))
    groups = {g.covariate.quantity: g for g in found.groups}
    for quantity in ("time", "command_voltage", "load_history", "previous_voltage"):
        group = groups[quantity]
        fall, rank = regressed(data, estimate.fit, group.covariate)
        assert (group.statistic, group.dof) == (pytest.approx(fall, rel=1e-6), rank)
        assert group.p_value == pytest.approx(max(chi2.sf(fall, rank), 1e-300), rel=1e-3)


def test_one_covariate_that_was_asked_for_alone_is_judged():
    data, estimate = known_noise({}, [short()])
    rows = data.rows[0].size
    only = Covariate("mood", (np.arange(rows) * 1.0,), "1", (np.sin(np.arange(rows) / 9.0)[:, None],), "it has moods")
    found = residual_structure(estimate.fit, data, estimate.weights, rng(0), [only])
    (group,) = found.groups
    assert group.dof == 1
    assert found.p_value == pytest.approx(group.p_value, abs=0.15)


def test_what_the_model_can_follow_is_no_structure():
    """Up and down times the size of the drive is C's own column on this plan: with it the statistic is three times
    that of the regression, as rounding goes with the level."""
    data, estimate, found = judged(short(change=PLANTED["command_voltage"]))
    group = next(g for g in found.groups if g.covariate.quantity == "direction_of_change")
    fall, rank = regressed(data, estimate.fit, group.covariate)
    assert (group.statistic, group.dof) == (pytest.approx(fall, rel=1e-6), rank)


def test_a_shape_is_trusted_to_a_few_per_cent_of_its_own_correction():
    """A dead band that is rounded off: without it there is structure, with it what is left is its shape error."""

    def rounded(V):
        return np.sign(V) * (np.sqrt((np.abs(V) - 1.5) ** 2 + 0.01) + np.abs(V) - 1.5) / 2

    _, _, found = judged(short(volts=rounded), {BAND: (1.5,)})
    assert found.p_value > ALARM
    _, _, bare = judged(short(volts=rounded))
    assert bare.p_value < 1e-9


# ---------------------------------------------------------------- places


def test_the_place_is_the_shortest_stretch_that_holds_most_of_it():
    data, estimate, found = judged(short(change=PLANTED["command_voltage"]))
    place = locate(found.groups[0].covariate, estimate.fit, data, estimate.weights)
    where = place.where
    assert (where.quantity, where.unit) == ("command_voltage", "V")
    assert (where.low, where.high) == pytest.approx((7.0, 9.0))
    assert place.share > 0.5
    table_ = {round(at): (mean, error) for at, mean, error in place.table}
    mean, error = table_[8]
    assert mean == pytest.approx(0.6, abs=5 * error + 0.1)
    h, r = data.histories[0], data.rows[0]
    at_8 = r[h.driver[r] == 8.0]
    assert place.samples == pytest.approx(h.count[at_8].sum() / h.count[r].sum())


def test_a_place_is_told_in_words():
    assert says(Place(Where("time", 3.0, 12.3456, "s"), 0.456, 0.0803, (), "it drifts")) == (
        "46 % of the residual lies at time 3 to 12.3 s, with 8 % of the samples: it drifts."
    )
    reverse = Place(Where("direction", -1.0, 0.0, "1"), 1.0, 0.5, (), "x")
    assert says(reverse) == "100 % of the residual lies in reverse, with 50 % of the samples: x."


def test_places_of_the_baseline_are_those_of_what_was_found():
    found = selected({BAND: (1.0,)}, [short(volts=dead_band(1.5))])
    places = places_of(found, found.after, rng(0), pulsing=False)
    assert places[0].where.quantity == "command_voltage"
    assert places[0].channel == "thrust"
    assert len(places) <= policy.locate.PLACES_TOLD
    assert all(0 < p.share <= 1 and p.where.quantity in p.statement for p in places)
    nothing = selected({}, [short()])
    assert places_of(nothing, nothing.after, rng(0), pulsing=False) == ()


# ---------------------------------------------------------------- pulses


def pulsed(share=-0.06, period=9.7, length=1.4, begin=4.0):
    return lambda t, _V, F: F * (1 + share * (((t - begin) % period) < length))


def test_a_gain_that_comes_back_is_found_with_its_period_and_share():
    data, estimate = known_noise({}, [short(change=pulsed(), seconds=160.0)])
    found = likeliest_pulses(estimate.fit, data, estimate.weights)
    assert found.p_value < 1e-9
    assert found.period == pytest.approx(9.7, rel=0.01)
    assert found.length == pytest.approx(1.4, abs=0.4)
    assert found.share == pytest.approx(-0.06, abs=0.012)
    assert "6" in found.statement
    assert found.statement.startswith("thrust is ")
    assert "% less for" in found.statement
    when = np.linspace(0, 160, 3000)
    assert np.mean(found.during(when) == (((when - 4.0) % 9.7) < 1.4)) > 0.93
    assert np.linalg.norm(found.column) == pytest.approx(1.0)


def test_noise_and_the_plans_own_repetition_are_no_pulses():
    for seed in range(4):
        data, estimate = known_noise({}, [short(seed=seed, seconds=120.0)])
        found = likeliest_pulses(estimate.fit, data, estimate.weights)
        assert found is None or found.p_value > 0.01
    data, estimate = known_noise({}, [table(lambda v: C * v * np.abs(v))], 0.05)
    assert likeliest_pulses(estimate.fit, data, estimate.weights) is None, "a table has no course of time"


def test_what_comes_back_with_the_plan_is_no_pulse():
    """Four levels that are run again and again, and a loss after one of them each time."""
    start = np.arange(0.0, 160.0, 3.0)
    volts = np.tile([0.0, 8.0, -6.0, 12.0], 20)[: start.size]
    t = np.arange(0.05, 160.0, 0.125)
    V = volts[np.searchsorted(start, t, side="right") - 1]
    lost = 0.06 * ((V == 8.0) & (t % 3.0 < 1.2))
    F = C * V * np.abs(V) * (1 - lost) + NOISE * rng(3).standard_normal(t.size)
    command = Channel("command_voltage", "command", "command_voltage", "V", start, volts)
    recording = replace(short(), channels=(command, Channel("thrust", "cell", "thrust", "N", t, F)))
    data, estimate = known_noise({}, [recording])
    found = likeliest_pulses(estimate.fit, data, estimate.weights)
    assert found is None or abs(found.period / 12.0 - round(found.period / 12.0)) > 0.01 or found.p_value > 0.01


def test_a_gain_that_is_restless_everywhere_is_no_pulse():
    """In proportion to the thrust, every second or so another: turbulence."""

    def restless(t, _V, F):
        return F * (1 + 0.04 * np.interp(t, np.arange(0.0, 200.0, 1.0), rng(8).standard_normal(200)))

    data, estimate = known_noise({}, [short(change=restless, seconds=160.0)])
    found = likeliest_pulses(estimate.fit, data, estimate.weights)
    assert found is None or found.p_value > 1e-3


# ---------------------------------------------------------------- slow changes


def drifting(t, _V, F):
    return F + 1.5 * (t / t[-1]) ** 2


def test_a_drift_is_told_from_noise_that_would_be_as_slow():
    """Fitted without it the noise is as slow as the drift; estimated together the drift is plain."""
    data, estimate = estimated({}, [short(change=drifting, seconds=160.0)])
    assert sum(estimate.noise.slow) > 0.02
    beside = beside_slow_change(estimate, data)
    assert beside is not None
    assert sum(beside.noise.slow) < 0.5 * sum(estimate.noise.slow)
    p = [each for each, _ in slow_changes(estimate, data)]
    assert min(p) < policy.locate.SLOW_CHANGE_FALSE_ALARM


def test_white_noise_has_no_slow_change():
    for seed in range(3):
        data, estimate = estimated({}, [short(seed=seed)])
        assert beside_slow_change(estimate, data) is None
    data, estimate = estimated({}, [table(lambda v: C * v * np.abs(v))])
    assert beside_slow_change(estimate, data) is None


def test_slow_columns_are_polynomials_of_each_runs_own_time():
    data, estimate = known_noise({}, [short(seed=s, seconds=40.0) for s in (0, 1)])
    zero, gain, quick = slow_columns(estimate, data)
    n = data.rows[0].size
    assert (zero.shape[1], gain.shape[1]) == (4, 4)
    assert quick.shape[1] > gain.shape[1]
    assert np.all(zero[:n, 2:] == 0)
    assert np.all(zero[n:, :2] == 0)
    time = data.histories[0].middle[data.rows[0]]
    across = 2 * (time - time[0]) / (time[-1] - time[0]) - 1
    assert zero[:n, 0] == pytest.approx(across)
    assert zero[:n, 1] == pytest.approx((3 * across**2 - 1) / 2)
    V = data.histories[0].driver[data.rows[0]]
    assert gain[:n, 0] == pytest.approx(across * estimate.fit.theta.C * V * np.abs(V) / data.scale.thrust)


# ---------------------------------------------------------------- the stage


def test_the_stage_hands_on_what_is_left_and_whether_it_is_more_than_noise():
    clean = selected({BAND: (1.0,)}, [short(volts=dead_band(1.5))])
    found = locate_stage(clean, rng(0))
    assert not found.structured
    assert found.estimate is clean.after
    lacking = selected({}, [short(volts=dead_band(1.5))])
    left = locate_stage(lacking, rng(0))
    assert left.structured
    assert left.left.groups[0].covariate.quantity == "command_voltage"


def test_what_the_last_screening_could_not_carry_is_left_too():
    """A candidate of seven sigma that no fit kept: its own covariate comes first."""
    clean = selected({}, [short()])
    jump = ZeroOffset()
    columns = rng(1).standard_normal((clean.after.fit.residual.size, 1))
    columns /= np.linalg.norm(columns)
    only = Directions((jump,), ((1.0, 20.0),), (False,), columns, np.ones(1))
    loud = Screening(only, np.array([9.0]), np.array([9.0]), 1e-12, 3.5)
    found = locate_stage(replace(clean, last=loud), rng(0))
    assert found.structured
    assert found.left.p_value == 1e-12
    assert found.left.groups[0].covariate.quantity in jump.covariates
    faint = replace(loud, z=np.array([3.4]), plain=np.array([3.4]), p_value=0.02)
    assert not locate_stage(replace(clean, last=faint), rng(0)).structured


def test_a_slow_change_is_left_over_time():
    data, _ = data_of([short(change=drifting, seconds=160.0)])
    _, estimate = estimated({}, [short(change=drifting, seconds=160.0)])
    found = locate_stage(replace(selected({}, [short()]), data=data, after=estimate), rng(0))
    assert found.structured
    assert found.left.groups[0].covariate.quantity == "time"
    assert found.estimate is not estimate
    again = fit(found.estimate.fit.model, found.estimate.fit.theta, data, found.estimate.weights)
    assert again.chi2 == pytest.approx(found.estimate.fit.chi2, rel=1e-3)
    assert orthogonal_basis(again.jacobian).shape[0] == again.residual.size
