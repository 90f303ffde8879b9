"""What a command does within an interval: the samples after a tick, beside the rotor integrated in tiny steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.model import Given, Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.sub_interval import delay_of, passed_on, sample_lead, shown
from identification.physics.command_saturation import CommandSaturation
from identification.physics.load_cell_saturation import LoadCellSaturation
from identification.physics.motor_lag import MotorLag
from identification.physics.stand_resonance import StandResonance
from identification.physics.time_skew import TimeSkew
from identification.recording import Channel, Recording
from tests.identification.mismatch.small import data_of

C = 0.5
TICK = 0.043
"""s between changes of the command."""
LAG = MotorLag("first_order")
SKEW = TimeSkew()


def ramp(seconds=30.0, rate=33.0):
    """A command that ticks up and down in small steps, and samples that come between them."""
    start = np.arange(0.0, seconds, TICK)
    volts = 9.0 * np.sin(2 * np.pi * start / 15.0)
    t = np.arange(0.011, seconds, 1 / rate)
    V = volts[np.searchsorted(start, t, side="right") - 1]
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", start, volts),
        Channel("thrust", "cell", "thrust", "N", t, C * V * np.abs(V)),
    )
    return Recording("ramp", "T1", channels), start, volts


def at_samples(start, volts, times, tau, delay=0.0):
    """(n,) thrust at each time of a rotor that follows the held command with a lag: exact from tick to tick."""
    ends = [volts[0]]
    for held, dt in zip(volts[:-1], np.diff(start), strict=True):
        ends.append(held + (ends[-1] - held) * np.exp(-dt / tau) if tau else held)
    index = np.maximum(np.searchsorted(start, times - delay, side="right") - 1, 0)
    since = np.maximum(times - delay - start[index], 0.0)
    x = volts[index] + (np.array(ends)[index] - volts[index]) * (np.exp(-since / tau) if tau else 0.0)
    return C * x * np.abs(x)


@pytest.fixture(scope="module")
def moving():
    recording, start, volts = ramp()
    data, _ = data_of([recording])
    return data, start, volts


def told(data, terms, values):
    thrust, _ = raw(Model(terms), Theta(C, values, (0.0,)), data, with_rate=False)
    return thrust[0]


def means(h, each):
    """(M,) of values at the samples."""
    inside = np.searchsorted(h.edges, h.sample_time, side="right") - 1
    return np.bincount(inside, each, h.driver.size) / np.maximum(np.bincount(inside, minlength=h.driver.size), 1)


@pytest.mark.parametrize("tau", [0.0, 0.04, 0.15])
def test_rows_are_means_of_what_a_rotor_does_at_their_samples(moving, tau):
    """To the last digits; means over intervals alone are off."""
    data, start, volts = moving
    h = data.histories[0]
    model, values = ((LAG,), ((tau,),)) if tau else ((), ())
    true = means(h, at_samples(start, volts, h.sample_time, tau))[h.rows]
    late = h.middle[h.rows] > 1.0
    assert np.max(np.abs(told(data, model, values) - true)[late]) < 1e-9
    smooth, _ = predict(Model(model), Theta(C, values, (0.0,)), data.runs[0], data.scale)
    assert np.std(smooth[h.rows] - true) > 1e-4 or not tau


@pytest.mark.parametrize("tau", [0.0, 0.04])
def test_a_delay_passes_ticks_on_late(moving, tau):
    """Up to the line between the means, a part in ten thousand of the thrust; without the ticks 0.01 N and more."""
    data, start, volts = moving
    h = data.histories[0]
    model, values = ((LAG, SKEW), ((tau,), (0.03,))) if tau else ((SKEW,), ((0.03,),))
    true = means(h, at_samples(start, volts, h.sample_time, tau, 0.03))[h.rows]
    off = (told(data, model, values) - true)[h.middle[h.rows] > 1.0]
    assert np.std(off) < 0.003
    smooth, _ = predict(Model(model), Theta(C, values, (0.0,)), data.runs[0], data.scale)
    assert np.std(smooth[h.rows] - true) > 0.008


def test_what_a_twin_gives_is_passed_on_as_what_is_found(moving):
    """A given lag was left out of the ticks: each run with a moving command got a second lag, or up and down apart."""
    data, start, volts = moving
    h = data.histories[0]
    model, values = (LAG, SKEW), ((0.05,), (0.03,))
    given = Model((), tuple(Given(t, v, data.scale) for t, v in zip(model, values, strict=True)))
    theta = Theta(C, (), (0.0,))
    found, _ = raw(Model(model), replace(theta, terms=values), data, with_rate=False)
    told_by_twin, _ = raw(given, theta, data, with_rate=False)
    assert told_by_twin[0] == pytest.approx(found[0], abs=1e-12)
    true = means(h, at_samples(start, volts, h.sample_time, 0.05, 0.03))[h.rows]
    assert np.std((told_by_twin[0] - true)[h.middle[h.rows] > 1.0]) < 0.003
    assert delay_of(given, theta) == pytest.approx(0.03)
    limit = Given(LoadCellSaturation("hard"), (20.0,), data.scale)
    F = C * h.driver * np.abs(h.driver)
    share = np.broadcast_to(shown(Model((), (limit,)), theta, h, F, h.driver, 0.0), F.shape)
    assert np.all(share[F > 21.0] == 0.0)


def test_a_lag_on_top_of_a_given_one_passes_ticks_on_as_one_of_both_times(moving):
    data = moving[0]
    theta = Theta(C, (), (0.0,))
    both = Model((), tuple(Given(LAG, (tau,), data.scale) for tau in (0.08, 0.02)))
    one, _ = raw(Model((LAG,)), Theta(C, ((0.1,),), (0.0,)), data, with_rate=False)
    two, _ = raw(both, theta, data, with_rate=False)
    smooth = [
        predict(m, t, data.runs[0], data.scale)[0]
        for m, t in ((both, theta), (Model((LAG,)), Theta(C, ((0.1,),), (0.0,))))
    ]
    h = data.histories[0]
    later = h.middle[h.rows] > 1.0
    ticks_of = [seen[0] - line[h.rows] for seen, line in zip((two, one), smooth, strict=True)]
    assert np.std((ticks_of[0] - ticks_of[1])[later]) < 0.1 * np.std(ticks_of[1][later])


def test_at_every_sample_a_lag_is_seen_too(moving):
    data, start, volts = moving
    h = data.histories[0]
    model, theta = Model((LAG,)), Theta(C, ((0.05,),), (0.0,))
    _, x = predict(model, theta, data.runs[0], data.scale)
    within = np.searchsorted(h.edges, h.sample_time, side="right") - 1
    line = np.interp(h.sample_time, h.middle, x)
    force = C * line * np.abs(line) + C * sample_lead(model, theta, data.runs[0], x[within], data.scale.driver)
    true = at_samples(start, volts, h.sample_time, 0.05)
    late = h.sample_time > 1.0
    rough = C * x[within] * np.abs(x[within])
    assert np.std((force - true)[late]) < 0.5 * np.std((rough - true)[late])


def test_what_the_drive_cuts_off_is_not_passed_on(moving):
    """Beyond the limit the command moves and the rotor does not."""
    data = moving[0]
    h = data.histories[0]
    term = CommandSaturation("hard")
    values = (5.0, *(p.high for p in term.parameters(data.scale)[1:]))
    model, theta = Model((term,)), Theta(C, (values,), (0.0,))
    share = np.broadcast_to(passed_on(model, theta, h), h.driver.shape)
    assert np.all(share[np.abs(h.driver) > 5.5] == 0.0)
    assert np.all(share[np.abs(h.driver) < 4.5] == 1.0)
    assert passed_on(Model(), replace(theta, terms=()), h) == 1.0


def test_what_the_cell_clips_is_not_shown(moving):
    data = moving[0]
    h = data.histories[0]
    term = LoadCellSaturation("hard")
    F = C * h.driver * np.abs(h.driver)
    model, theta = Model((term,)), Theta(C, ((20.0,),), (2.0,))
    share = np.broadcast_to(shown(model, theta, h, F, h.driver, 2.0), F.shape)
    assert np.all(share[F + 2.0 > 21.0] == 0.0)
    assert np.all(share[np.abs(F + 2.0) < 19.0] == 1.0)


def test_delays_of_a_model_add_up_and_only_clocks_delay():
    assert delay_of(Model(), Theta(C, (), (0.0,))) == 0.0
    model = Model().plus(LAG).plus(SKEW).plus(StandResonance())
    values = {LAG: (0.2,), SKEW: (0.03,), StandResonance(): (1.0, 8.0, 0.1)}
    theta = Theta(C, tuple(values[t] for t in model.terms), (0.0,))
    assert delay_of(model, theta) == pytest.approx(0.03)


def test_a_stand_that_rings_passes_on_less_of_ticks_far_above_its_frequency(moving):
    """A soft stand of 1 Hz follows none of twenty ticks a second: its rows are smooth."""
    data = moving[0]
    ring = told(data, (StandResonance(),), ((1.0, 1.0, 0.7),))
    rigid = told(data, (), ())
    assert np.std(np.diff(ring, 2)) < 0.3 * np.std(np.diff(rigid, 2))
