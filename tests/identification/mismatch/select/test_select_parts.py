"""Flat readings, covariates, what may be chosen, and the baseline it is added to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.mismatch.estimate.estimate import Estimate, forces
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.baseline import baseline, level_error_factor, raw_directions
from identification.mismatch.select.covariates import covariates, hats
from identification.mismatch.select.exchange.static_pairs import static_curve
from identification.mismatch.select.forward_selection import available
from identification.mismatch.select.limits.flatness import noise_goes_on
from identification.physics.catalogue import CATALOGUE
from identification.physics.dead_band import DeadBand
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag
from identification.physics.winding_resistance import WindingResistance
from identification.recording import Acquisition, Channel, Recording
from tests.identification.diagnosed_runs import NOISE, C, table
from tests.identification.mismatch.small import data_of, estimated, known_noise, placed, rng, short, white

CLIPS = LoadCellSaturation("hard")


def clipped(*, cell):
    """Readings that end at 60 N: by the cell, noise and all, or by what drives."""

    def cut(F):
        return np.clip(F, -60.0, 60.0)

    run = short(change=None if cell else lambda _t, _V, F: cut(F), rate=20.0, tare=0.0)
    command, thrust = run.channels
    return replace(run, channels=(command, replace(thrust, value=cut(thrust.value)))) if cell else run


@pytest.mark.parametrize("cell", [True, False])
def test_noise_that_goes_on_tells_that_no_cell_clips(cell):
    data, estimate = known_noise({CLIPS: (60.0,)}, [clipped(cell=cell)])
    told = replace(estimate.fit, theta=replace(estimate.fit.theta, terms=((60.0,),)))
    assert noise_goes_on(told, CLIPS, estimate.noise, data) is not cell
    assert noise_goes_on(told, DeadBand(), estimate.noise, data) is False


def ramped(limit, conversions=200, every=0.05):
    """Ramps in ticks of 0.1 V to 12 V and back; each sample the mean of conversions since the last, which clip."""
    up = np.arange(-12.0, 12.01, 0.1)
    volts = np.concatenate([up, np.full(50, 12.0), up[::-1], np.full(50, -12.0)] * 6)
    when = 0.02 * np.arange(volts.size) + 0.013
    t = np.arange(1.0, when[-1], every)
    then = t[:, None] - every * (1.0 - (np.arange(conversions) + 0.5) / conversions)
    V = volts[np.searchsorted(when, then, side="right") - 1]
    each = NOISE * conversions**0.5 * rng(2).standard_normal(V.shape)
    F = np.clip(C * V * np.abs(V) + each, -limit, limit).mean(axis=1)
    command = Channel("command_voltage", "command", "command_voltage", "V", when, volts)
    means = Channel("thrust", "cell", "thrust", "N", t, F, acquisition=Acquisition(window=every))
    return Recording("ramped", "T1", (command, means))


@pytest.mark.parametrize("limit", [70.0, 72.0])
def test_a_ramp_on_its_way_is_no_noise(limit):
    """On a ramp a mean of conversions is not foretold to a part of a tick: by the ramps the noise would go on."""
    cell = LoadCellSaturation("averaged")
    values = (limit, NOISE * 200**0.5)
    data, theta = data_of([ramped(limit)])
    model, begin = placed({cell: values}, replace(theta, C=C))
    found = fit(model, begin, data, white(data, model, begin))
    assert not noise_goes_on(found, cell, Noise(NOISE**2, 0.0), data)


def test_a_limit_that_no_reading_reaches_is_not_doubted():
    data, estimate = known_noise({CLIPS: (90.0,)}, [short(rate=20.0)])
    assert not noise_goes_on(estimate.fit, CLIPS, estimate.noise, data)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-50, 50), min_size=2, max_size=8, unique=True), st.integers(0, 999))
def test_hats_share_out_one_and_carry_a_straight_line(knots, seed):
    knots = np.array(sorted(knots))
    if np.min(np.diff(knots)) < 1e-3:
        return
    value = rng(seed).uniform(-80, 80, 60)
    found = hats(value, knots)
    assert np.all(found >= 0)
    assert found.sum(axis=1) == pytest.approx(np.ones(60))
    assert found @ knots == pytest.approx(np.clip(value, knots[0], knots[-1]), abs=1e-6)


def test_every_quantity_that_was_recorded_is_looked_over():
    t = np.arange(0.0, 80.0, 0.5)
    beside = (
        Channel("w", "w", "water_temperature", "degC", t, 15 + t / 40),
        Channel("u", "u", "flow_speed", "m/s", t, 0.2 + 0.1 * np.sin(t)),
    )
    run = short()
    data, estimate = known_noise({}, [replace(run, channels=(*run.channels, *beside))])
    found = {c.quantity: c for c in covariates(estimate.fit, data)}
    every = {"command_voltage", "direction", "time", "time_since_step", "previous_voltage", "direction_of_change"}
    assert every | {"load_history", "water_temperature", "flow_speed"} <= found.keys()
    for c in found.values():
        assert all(col.shape[0] == r.size for col, r in zip(c.columns, data.rows, strict=True))
        assert all(v.size == r.size for v, r in zip(c.values, data.rows, strict=True))
    h, r = data.histories[0], data.rows[0]
    assert found["time_since_step"].values[0] == pytest.approx(h.since_step[r])
    assert found["previous_voltage"].values[0] == pytest.approx(h.previous[r])
    constant = replace(beside[0], value=np.full(t.size, 15.0))
    flat, now = known_noise({}, [replace(run, channels=(*run.channels, constant))])
    assert "water_temperature" not in {c.quantity for c in covariates(now.fit, flat)}


@pytest.mark.parametrize(
    ("quantity", "shape"),
    [
        ("command_voltage", lambda h: np.abs(h.driver) == 8.0),
        ("time", lambda h: h.middle > 40),
        ("previous_voltage", lambda h: h.previous > 5),
        ("time_since_step", lambda h: np.exp(-h.since_step / 0.5) * h.driver * np.abs(h.driver)),
    ],
)
def test_a_covariates_columns_carry_a_shape_over_it(quantity, shape):
    data, estimate = known_noise({}, [short()])
    found = next(c for c in covariates(estimate.fit, data) if c.quantity == quantity)
    y = shape(data.histories[0])[data.rows[0]].astype(float)
    X = np.column_stack([found.columns[0], np.ones(y.size)])
    rest = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    assert np.var(rest) < 0.25 * np.var(y)


def test_a_table_is_looked_over_its_levels_only():
    data, estimate = known_noise({}, [table(lambda v: C * v * np.abs(v))], 0.05)
    assert {c.quantity for c in covariates(estimate.fit, data)} == {"command_voltage", "direction"}


def test_only_terms_whose_channels_were_recorded_may_be_chosen():
    data, _ = data_of([short()])
    ids = {t.id for t in available(data)}
    assert all(not t.needs for t in available(data))
    assert "speed_of_advance" not in ids
    assert {"dead_band", "motor_lag", "exponent"} <= ids
    assert "dead_band" not in {t.id for t in available(data, without=("dead_band",))}
    t = np.arange(0.0, 80.0, 0.5)
    run = short()
    wet = replace(run, channels=(*run.channels, Channel("u", "u", "flow_speed", "m/s", t, 0.2 + t / 100)))
    assert "speed_of_advance" in {x.id for x in available(data_of([wet])[0])}
    still = replace(run, channels=(*run.channels, Channel("u", "u", "flow_speed", "m/s", t, 0.0 * t)))
    assert "speed_of_advance" not in {x.id for x in available(data_of([still])[0])}
    both, _ = data_of([wet, short(seed=1)])
    assert "speed_of_advance" not in {x.id for x in available(replace(both, scale=replace(both.scale, flow=1.0)))}


def test_a_table_and_a_rate_that_drives_leave_out_what_they_cannot_show():
    flat, _ = data_of([table(lambda v: C * v * np.abs(v))])
    assert {t.id for t in available(flat)}.isdisjoint({"motor_lag", "hysteresis", "zero_drift", "heating"})
    t = np.arange(0.0, 80.0, 0.1)
    rate = Channel("n", "n", "rotation_rate", "rev/s", t, 10 * np.sin(t / 4))
    run = short()
    turning, _ = data_of([replace(run, channels=(rate, run.channels[1]))])
    assert {t.stage for t in available(turning)} <= {"hydro", "stand", "cell"}


def test_where_the_channel_that_shows_it_was_recorded_an_effect_must_use_it():
    t = np.arange(0.0, 80.0, 0.5)
    run = short()
    bus = replace(run, channels=(*run.channels, Channel("b", "b", "bus_voltage", "V", t, 24 - 0.01 * t)))
    forms = {x.form for x in available(data_of([bus])[0]) if x.id == "supply_sag"}
    without = {x.form for x in available(data_of([run])[0]) if x.id == "supply_sag"}
    assert forms
    assert forms.isdisjoint(without)


def test_on_which_static_curve_a_term_is():
    assert static_curve(MotorLag("first_order"), measured=False) == ""
    assert static_curve(DeadBand(), measured=False) == "thrust"
    assert static_curve(DeadBand(), measured=True) == "rate"
    assert static_curve(WindingResistance(), measured=True) == "rate"
    assert {static_curve(t, measured=True) for t in CATALOGUE} == {"", "rate", "thrust"}


def test_what_is_plainly_no_noise_does_not_make_the_noise_louder():
    """A dead band of 1.5 V: taken for noise it would be ten times as loud."""
    data, theta = data_of([short(volts=lambda V: np.sign(V) * np.maximum(np.abs(V) - 1.5, 0.0))])
    model, theta = placed({}, theta)
    found = baseline(data, theta, available(data), model)
    assert isinstance(found, Estimate)
    assert np.sqrt(found.noise.white + sum(found.noise.slow)) < 2.2 * NOISE
    left = forces(found.fit.model, found.fit.theta, data)
    assert np.std(data.thrust[0] - left[0]) > 4 * NOISE


def test_raw_directions_are_the_change_of_the_thrust_by_each_trial():
    data, estimate = known_noise({}, [short()])
    band = DeadBand()
    found = raw_directions(estimate.fit, data, [band])
    trials = band.trials(data.scale)
    assert found.shape == (data.size, len(trials))
    V = data.histories[0].driver[data.rows[0]]
    x = np.sign(V) * np.maximum(np.abs(V) - trials[0][0], 0.0)
    change = estimate.fit.theta.C * (x * np.abs(x) - V * np.abs(V))
    assert found[:, 0] == pytest.approx(change, abs=1e-6)
    assert raw_directions(estimate.fit, data, []).shape == (data.size, 0)


def test_levels_of_a_measured_driver_share_the_error_of_their_mean():
    t = np.arange(0.0, 80.0, 0.05)
    level = np.repeat(rng(1).uniform(4, 12, 20), 80)
    n = level + 0.2 * rng(2).standard_normal(t.size)
    F = 0.1 * level * np.abs(level) + NOISE * rng(3).standard_normal(t.size)
    channels = (
        Channel("n", "n", "rotation_rate", "rev/s", t, n),
        Channel("thrust", "cell", "thrust", "N", t + 0.01, F),
    )
    data, theta = data_of([Recording("levels", "T1", channels)])
    h = data.histories[0]
    assert h.level_errors.shape[1] > 10
    factor = level_error_factor(data, theta.C)
    expected = (2 * theta.C * np.abs(h.driver)[:, None] * h.level_errors)[h.rows]
    assert factor.thrust[0] == pytest.approx(expected)
    still, _ = data_of([short()])
    assert level_error_factor(still, C) is None
    data, estimate = estimated({}, [Recording("levels", "T1", channels)])
    dof = data.size - 2
    assert estimate.fit.chi2 < dof + 6 * np.sqrt(2 * dof), "levels scatter more than their samples, and may"
    assert white(data, *placed({}, theta)).prior_factor is None


def test_a_jump_at_one_instant_of_several_runs_is_none_of_the_zero():
    jump = {("zero_offset", "")}
    one, several = (data_of([short(seed=i) for i in range(runs)])[0] for runs in (1, 2))
    assert jump <= {(t.id, t.form) for t in available(one)}
    assert not jump & {(t.id, t.form) for t in available(several)}
    assert {t.id for t in available(one)} - {t.id for t in available(several)} == {"zero_offset"}
