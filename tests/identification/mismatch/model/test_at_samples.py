"""Thrust as the samples of each interval show it, against sums over those very samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.model.at_samples import at_samples
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.physics.motor_lag import MotorLag
from identification.recording import Acquisition, Channel, Recording
from tests.identification.mismatch.small import data_of, placed

C, TARE = 0.5, 1.5
LAG, TAU = MotorLag("first_order"), 0.12
NONE, BARE = Model(), Theta(C, (), (TARE,))


def held(start, volts, at):
    """(n,) V at times of a command that is held between."""
    return volts[np.maximum(np.searchsorted(start, at, side="right") - 1, 0)]


def followed(start, volts, at):
    """(n,) V that a rotor of TAU s makes of it: exact from step to step."""
    ends = [volts[0]]
    for step, dt in zip(volts[:-1], np.diff(start), strict=True):
        ends.append(step + (ends[-1] - step) * np.exp(-dt / TAU))
    index = np.maximum(np.searchsorted(start, at, side="right") - 1, 0)
    since = np.maximum(at - start[index], 0.0)
    return volts[index] + (np.array(ends)[index] - volts[index]) * np.exp(-since / TAU)


def force(V):
    return C * V * np.abs(V)


START = np.arange(0.0, 40.0, 2.017)
VOLTS = 12.0 * np.random.default_rng(3).uniform(-1, 1, START.size)
TIMES = np.arange(0.003, 40.0, 0.05)


@pytest.fixture(scope="module")
def stepped():
    """Levels of two seconds, twenty samples each second."""
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", START, VOLTS),
        Channel("thrust", "cell", "thrust", "N", TIMES, force(held(START, VOLTS, TIMES)) + TARE),
    )
    data, _ = data_of([Recording("stepped", "T1", channels)])
    return data, data.runs[0]


def told(data, run, model=NONE, theta=BARE, late=0.0):
    return at_samples(model, theta, run, data.scale, TARE, late)


def means(run, value):
    return run.samples("thrust").means(value)[run.history.rows]


def test_of_a_held_command_it_is_the_mean_over_the_samples_and_the_rate_the_volts(stepped):
    data, run = stepped
    F, x = told(data, run)
    h = run.history
    assert F[h.rows] == pytest.approx(means(run, force(held(START, VOLTS, h.sample_time))), abs=1e-9)
    middle = held(START, VOLTS, h.middle)
    whole = np.abs(held(START, VOLTS, h.edges[1:] - 1e-9) - held(START, VOLTS, h.edges[:-1])) < 1e-12
    assert x[whole] == pytest.approx(middle[whole])


def test_of_a_rotor_that_lags_it_is_the_same_where_it_turns_by_then(stepped):
    data, run = stepped
    model, theta = placed({LAG: (TAU,)}, BARE)
    F, _ = told(data, run, model, theta)
    true = means(run, force(followed(START, VOLTS, run.history.sample_time)))
    assert np.std(F[run.history.rows] - true) < 0.01 * np.std(true)
    assert np.std(told(data, run)[0][run.history.rows] - true) > 0.1 * np.std(true), "a lag of a tenth is seen"


def test_of_ticks_as_fast_as_the_samples_it_is_what_was_held_at_each_of_them():
    """A ramp whose ticks come between the samples: the line through the means is off by half a tick at some."""
    start = np.arange(0.0, 30.0, 0.043)
    volts = 9.0 * np.sin(2 * np.pi * start / 15.0)
    t = np.arange(0.011, 30.0, 1 / 33.0)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, volts),
        Channel("thrust", "cell", "thrust", "N", t, force(held(start, volts, t)) + TARE),
    )
    data, _ = data_of([Recording("ramp", "T1", channels)])
    run = data.runs[0]
    rows = run.history.rows[2:-2]
    true = run.samples("thrust").means(force(held(start, volts, run.history.sample_time)))[rows]
    left = told(data, run)[0][rows] - true
    assert np.std(left) < 0.01
    assert np.std(force(run.history.driver[rows]) - true) > 5 * np.std(left)


def test_a_shift_of_the_clocks_moves_the_force_and_not_the_rate(stepped):
    data, run = stepped
    shift = 0.4
    F, x = told(data, run, theta=replace(BARE, shift=shift), late=shift)
    true = means(run, force(held(START, VOLTS, run.history.sample_time - shift)))
    settled = np.abs(means(run, force(held(START, VOLTS, run.history.sample_time - shift - 0.3))) - true) < 1e-9
    settled &= np.abs(means(run, force(held(START, VOLTS, run.history.sample_time - shift + 0.3))) - true) < 1e-9
    assert settled.mean() > 0.4
    assert F[run.history.rows][settled] == pytest.approx(true[settled], abs=1e-6)
    assert np.array_equal(x, told(data, run)[1])


def test_the_tare_is_no_part_of_it(stepped):
    data, run = stepped
    other = at_samples(NONE, replace(BARE, tares=(9.0,)), run, data.scale, 9.0, 0.0)
    assert np.array_equal(other[0], told(data, run)[0])


def test_a_mean_over_a_window_is_not_the_force_in_the_middle_of_it():
    """A rate that is measured, and swings within the window of a slow cell: the mean of its square is more."""
    window, rate = 0.5, 20.0
    t = np.arange(0.0, 60.0, 1 / rate)

    def turning(at):
        return 8.0 + 3.0 * np.sin(2 * np.pi * at / 4.0)

    at = np.arange(1.0, 59.0, 0.5)
    fine = (np.arange(2000) + 0.5) / 2000 - 0.5
    shown = np.array([force(turning(when + window * fine)).mean() for when in at])
    how = Acquisition(window=window, delay=0.5 * window)
    channels = (
        Channel("rotation_rate", "encoder", "rotation_rate", "rev/s", t, turning(t)),
        Channel("thrust", "cell", "thrust", "N", at, shown, acquisition=how),
    )
    data, _ = data_of([Recording("slow", "T1", channels)])
    run = data.runs[0]
    assert not run.history.converter.instant
    assert run.history.ticks is None
    F, x = told(data, run)
    inside = slice(2, -2)
    assert F[run.history.rows][inside] == pytest.approx(shown[inside], rel=0.01)
    assert x == pytest.approx(turning(run.history.middle), abs=0.2)
