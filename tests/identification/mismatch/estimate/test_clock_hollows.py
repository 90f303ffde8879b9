"""A telemetry whose rows keep step with the command's ticks, and is late: its clock is found past the next tick."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.clock_hollows import by_its_clocks, in_best_hollow, with_clocks_of
from identification.mismatch.estimate.fitting import change_of_rates, fit, raw, residual_of
from identification.mismatch.model.model import Model
from identification.mismatch.model.whitening import weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.baseline import baseline
from identification.mismatch.select.screening import directions
from identification.physics.inflow_dynamics import InflowDynamics
from identification.physics.motor_lag import MotorLag
from identification.recording import Acquisition, Channel, Recording
from tests.identification.diagnosed_runs import TOP, C
from tests.identification.mismatch.small import data_of

LATE = 0.002
"""s"""


def in_step(late=LATE, after=0.0015, scatter=0.0006, every=0.05, rate_late=None):
    """Ramps written and rates told a hundred times a second, force and rate 2 ms late, rows scattered about the ticks.

    `rate_late`: s, where the rate is late by something else.
    """
    rng = np.random.default_rng(3)
    when = 0.01 * np.arange(4000) + 0.003
    volts = TOP * np.interp(when, np.arange(0.0, 41.0, 2.0), rng.uniform(-1.0, 1.0, 21))
    volts = np.round(volts / 0.05) * 0.05
    told = when + after + rng.normal(0.0, scatter, when.size)
    thrust = np.arange(0.5, 39.5, every)

    def held(t):
        return volts[np.maximum(np.searchsorted(when, t, side="right") - 1, 0)]

    F = C * held(thrust - late) * np.abs(held(thrust - late)) + 0.05 * rng.standard_normal(thrust.size)
    rate = 2.0 * held(told - (late if rate_late is None else rate_late)) + 0.003 * rng.standard_normal(told.size)
    unsure = Acquisition(delay_std=0.002)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", when, volts, acquisition=unsure),
        Channel("thrust", "cell", "thrust", "N", thrust, F),
        Channel("rotation_rate", "motor", "rotation_rate", "rev/s", told, rate),
    )
    return Recording("in-step", "T1", channels, source="in-step.h5")


def stood(data):
    sizes = [np.zeros(rows.size) for rows in data.rows]
    return weights(data, Noise(0.05**2, 0.0), sizes, Noise(0.003**2, 0.0), unit=True)


def settled(data, theta):
    w = stood(data)
    return in_best_hollow(fit(Model(), theta, data, w), data, w)


def test_the_lateness_of_both_is_found_past_a_tick_whatever_it_begins_with():
    data, theta = data_of([in_step(every=0.0497)], clocks=True)  # samples that drift past the ticks tell of both
    assert data.with_rate
    for begin in (0.0, -0.005, 0.005):
        found = settled(data, replace(theta, shift=begin, rate_shift=-begin)).theta
        assert found.rate_shift == pytest.approx(LATE, abs=2e-4)
        assert found.shift == pytest.approx(LATE, abs=5e-4)


def test_a_rate_that_keeps_step_is_found_so_from_any_hollow():
    """Microseconds from it chi-square was 60 more, and a lag that came from there gained as much."""
    data, theta = data_of([in_step(after=0.0005, scatter=0.0003, every=0.0497, rate_late=0.0)], clocks=True)
    begins = (replace(theta, shift=LATE, rate_shift=late) for late in (-0.0016, -0.0004, -0.0002, 0.0003, 0.0016))
    chi2 = [fit(Model(), begin, data, stood(data)).chi2 for begin in begins]
    assert max(chi2) - min(chi2) < 3.0


def test_the_clock_of_the_rate_changes_the_rate_alone():
    data, theta = data_of([in_step()], clocks=True)
    model, theta, w = Model((MotorLag("quadratic"),)), replace(theta, terms=((0.02,),)), stood(data)
    moved = replace(theta, rate_shift=0.0013)
    before, after = (residual_of(model, each, data, w) for each in (theta, moved))
    assert np.max(np.abs(before - after)) > 0.1
    assert change_of_rates(model, theta, moved, data, w) == pytest.approx(before - after, abs=1e-9)


def test_nothing_that_smooths_ticks_is_wanted_beside_it():
    """A lag of microseconds once took two thirds of the misfit away: it alone had found the hollow."""
    data, theta = data_of([in_step()], clocks=True)
    before = baseline(data, theta, (MotorLag("first_order"),), Model())
    model, begin = before.fit.more(MotorLag("first_order"), (1e-5,))
    lagging = fit(model, begin, data, before.weights)
    assert before.fit.chi2 - lagging.chi2 < 10.0
    assert before.fit.theta.rate_shift == pytest.approx(LATE, abs=2e-4)


def test_clocks_that_agree_stay():
    data, theta = data_of([in_step(0.0)], clocks=False)
    assert settled(data, theta).theta.rate_shift == 0
    doubted = replace(data, most_shift=0.006)
    assert abs(settled(doubted, theta).theta.rate_shift) < 2e-4


@pytest.mark.parametrize("off", [-3e-4, 3e-4])
def test_clocks_that_a_tick_stops_stop_nothing_else(off):
    """C by least squares with the clocks where they ended: where each row stands at the edge of a tick, no step of all
    parameters together was better, and C stayed where it began, two standard errors away."""
    recording = in_step(after=0.0023, scatter=0.0003)
    data, theta = data_of([recording], clocks=True)
    begin = replace(settled(data, theta).theta, C=C * (1 + off))
    w = stood(data)
    found = fit(Model(), begin, data, w)
    held, _ = data_of([recording], clocks=False)
    alone = fit(Model(), found.theta, replace(held, with_rate=False), replace(w, rate=()))
    assert pytest.approx(alone.theta.C, abs=0.2 * found.std[0]) == found.theta.C


def test_two_fits_are_compared_by_the_same_clocks():
    """One that ended with its samples on the wrong side of ticks takes the clocks of the other, which did not."""
    data, theta = data_of([in_step(every=0.0497)], clocks=True)
    w = stood(data)
    right = settled(data, theta)
    wrong = fit(Model(), replace(theta, shift=-0.005, rate_shift=0.005), data, w)
    assert wrong.chi2 > 1.1 * right.chi2
    assert by_its_clocks(wrong, right, data, w).chi2 == pytest.approx(right.chi2, rel=1e-3)
    assert by_its_clocks(right, wrong, data, w) is right


def test_a_part_keeps_the_clocks_that_all_rows_had():
    """5 us that the rows of a part did not mind put one of the others on the wrong side of a tick: a jump of the zero
    of 40 sigma was refused, for it predicted that one row worse."""
    data, theta = data_of([in_step(every=0.0497)], clocks=True)
    whole = settled(data, theta)
    moved = replace(whole.theta, shift=whole.theta.shift + 1e-4)
    old, new = (raw(Model(), each, data, with_rate=False)[0][0] for each in (whole.theta, moved))
    passed = np.abs(new - old) > 0.2
    assert 0 < np.count_nonzero(passed) < 0.1 * passed.size
    part = replace(data, keep=(~passed,), with_rate=False)
    w = weights(part, Noise(0.05**2, 0.0), [np.zeros(r.size) for r in part.rows], None, unit=True)
    found = fit(Model(), moved, part, w)
    kept = with_clocks_of(whole.theta, found, part, w)
    assert kept.theta.shift == whole.theta.shift
    assert kept.chi2 < found.chi2 + 1.0
    told = replace(whole.theta, shift=moved.shift)
    assert with_clocks_of(told, whole, data, stood(data)) is whole, "all rows mind"


def leading():
    """A ramp of two minutes in ticks of 51 ms; thrust comes 4 ms before it, as water makes it that must follow."""
    rng = np.random.default_rng(5)
    when = 2.0 + 0.0506 * np.arange(2400)
    volts = TOP * np.interp(when, [2.0, 32.0, 92.0, 122.0], [0.0, 1.0, -1.0, 0.0])
    thrust = 0.0195 + 0.02727 * np.arange(4500)
    now = volts[np.maximum(np.searchsorted(when, thrust, side="right") - 1, 0)]
    smooth = TOP * np.interp(thrust, [2.0, 32.0, 92.0, 122.0], [0.0, 1.0, -1.0, 0.0])
    early = TOP * np.interp(thrust - 0.12, [2.0, 32.0, 92.0, 122.0], [0.0, 1.0, -1.0, 0.0])
    F = C * now * np.abs(now) + 0.034 * C * np.abs(now) * (smooth - early)
    return Recording(
        "leading",
        "T1",
        (
            Channel("command_voltage", "command", "command_voltage", "V", when, volts),
            Channel("thrust", "cell", "thrust", "N", thrust, F + 0.02 * rng.standard_normal(F.size)),
        ),
        source="leading.h5",
    )


def test_a_lead_that_no_shift_of_samples_makes_is_not_hidden_by_its_slope():
    """The clock's slope was all of it, and a tick kept the clock from following: nothing was found, nothing left."""
    data, theta = data_of([leading()], clocks=True)
    sizes = [np.zeros(rows.size) for rows in data.rows]
    w = weights(data, Noise(0.02**2, 0.0), sizes, None, unit=True)
    found = fit(Model(), theta, data, w)
    sought = directions(found, data, w, [InflowDynamics()])
    assert not found.free[found.layout.shift]
    assert np.max(sought.columns.T @ found.residual) > 10.0
