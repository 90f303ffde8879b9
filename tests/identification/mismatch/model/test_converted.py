"""Samples of a command that ticks as fast as they, averaged and behind a low pass: what beats is no disturbance."""

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.converted import converted_samples
from identification.mismatch.model.predictor import predict
from identification.mismatch.periodic.full_rate import series_of
from identification.mismatch.prepare.chain.acquisition import as_sampled
from identification.physics.motor_lag import MotorLag
from identification.recording import Acquisition, Channel, Recording
from identification.run_history.converter import Converter
from identification.run_history.filters import within_intervals
from tests.identification.diagnosed_runs import TOP, C
from tests.identification.mismatch.small import data_of, known_noise, placed

RATE, LOOP, SECONDS = 80.0, 100.0, 130.0
NOISE = 0.02
FINE = 2.5e-4


def ticking(converter, lag=0.0, noise=0.0):
    """A sine of 9 s written a hundred times a second, sampled eighty times, stamped at the end of the window."""
    when = np.arange(0.0, SECONDS, 1 / LOOP) + 0.003
    volts = TOP * np.sin(2 * np.pi * when / 9.0)
    knots, value = when, volts
    if lag:
        knots = np.arange(0.0, SECONDS, FINE)
        held = volts[np.maximum(np.searchsorted(when, knots, side="right") - 1, 0)]
        value, keep = np.zeros(knots.size), np.exp(-FINE / lag)
        for i in range(1, knots.size):
            value[i] = keep * value[i - 1] + (1 - keep) * held[i - 1]
    edges = np.append(knots, knots[-1] + 1.0)
    at = np.arange(1.0, SECONDS - 1.0, 1 / RATE)
    force = converter.shown(C * value * np.abs(value), np.diff(edges), converter.places(edges, at))
    force += noise * np.random.default_rng(4).standard_normal(at.size)
    how = Acquisition(window=converter.window, low_pass=converter.low_pass, delay=converter.low_pass)
    stamped = at + 0.5 * converter.window
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", when, volts),
        Channel("thrust", "cell", "thrust", "N", stamped, force, acquisition=how),
    )
    return as_sampled(Recording("ticking", "T1", channels, source="ticking.h5"))[0]


CONVERTERS = [Converter(1 / RATE), Converter(1 / RATE, 0.004), Converter(0.0, 0.006)]


@pytest.mark.parametrize("converter", CONVERTERS)
def test_what_ticks_do_in_averaged_samples_is_predicted(converter):
    """A tick at the steepest is 0.3 N; a twentieth of it is left."""
    data, theta = data_of([ticking(converter)])
    assert data.histories[0].edges.size < SECONDS * LOOP, "more ticks than intervals"
    model, theta = placed({}, theta)
    (told,), _ = raw(model, theta, data, with_rate=False)
    assert np.std(told - data.thrust[0]) < 0.015


@pytest.mark.parametrize("converter", CONVERTERS)
def test_no_line_is_left_where_ticks_beat_with_samples(converter):
    """The 100 Hz of the command at 80 samples/s is 20 Hz."""
    data, estimate = known_noise({}, [ticking(converter, noise=NOISE)])
    (series,) = series_of(estimate.fit, data)
    wave = np.exp(2j * np.pi * (LOOP - RATE) * series.time)
    assert 2 * np.abs(np.mean(series.residual * wave)) < 4 * NOISE * np.sqrt(2 / series.time.size)
    assert np.std(series.residual) == pytest.approx(NOISE, rel=0.15)


@pytest.mark.parametrize("converter", CONVERTERS)
def test_a_rotor_that_follows_smooths_the_ticks_first(converter):
    data, theta = data_of([ticking(converter, lag=0.004)])
    model, theta = placed({MotorLag("first_order"): (0.004,)}, theta)
    (told,), _ = raw(model, theta, data, with_rate=False)
    assert np.std(told - data.thrust[0]) < 0.02


@pytest.mark.parametrize("converter", CONVERTERS)
def test_hardly_any_lag_is_next_to_none(converter):
    """A screening puts a little of each term into the model: what that changes is no more than a lag of so little."""
    data, theta = data_of([ticking(converter)])
    model, none = placed({}, theta)
    (at_once,), _ = raw(model, none, data, with_rate=False)
    model, little = placed({MotorLag("first_order"): (1e-5,)}, theta)
    (late,), _ = raw(model, little, data, with_rate=False)
    fastest = np.max(np.abs(np.diff(at_once) / np.diff(data.thrust_rows[0].time)))
    assert np.max(np.abs(late - at_once)) < 3e-5 * fastest


@pytest.mark.parametrize("converter", CONVERTERS)
@pytest.mark.parametrize("lag", [0.0, 0.004])
def test_each_sample_is_told_as_the_converter_shows_it(converter, lag):
    """The recording itself, without noise; means over intervals alone leave twice as much and more."""
    data, theta = data_of([ticking(converter, lag=lag)])
    model, theta = placed({MotorLag("first_order"): (lag,)} if lag else {}, theta)
    (run,) = data.runs
    F, _ = predict(model, theta, run, data.scale, 0.0)
    told = converted_samples(model, theta, run, F, data.scale.driver)
    untold = within_intervals(run.converted_amid(F), run.history.edges, run.history.sample_time)
    left, rough = (np.std(run.history.sample_thrust - each - theta.tares[0]) for each in (told, untold))
    assert left < 0.02
    assert left < 0.5 * rough
