"""The stage: what a fit leaves at every sample, the runs without their lines, and a band of noise handed on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch.periodic import stage
from identification.mismatch.periodic.full_rate import scale_std_of, series_of, with_scale
from identification.mismatch.periodic.periodic_disturbances import Line, find_lines
from identification.physics.time_skew import TimeSkew
from identification.recording import Channel
from tests.identification.diagnosed_runs import NOISE, levels, run
from tests.identification.mismatch.small import estimated, known_noise, rng, short


def hum(frequency=4.0, size=1.0):
    return lambda t, _V, F: F + size * np.sin(2 * np.pi * frequency * t + 1.0)


def noisy(**how):
    return short(rate=25.0, **how)


def test_the_residual_at_every_sample_is_measured_less_held_command():
    recording = noisy()
    data, estimate = known_noise({}, [recording])
    (series,) = series_of(estimate.fit, data)
    thrust, command = recording.first_of("thrust"), recording.first_of("command_voltage")
    V = np.nan_to_num(command.held_at(series.time))
    theta = estimate.fit.theta
    expected = np.interp(series.time, thrust.time, thrust.value) - theta.C * V * np.abs(V) - theta.tares[0]
    assert series.residual == pytest.approx(expected, abs=1e-6)
    assert np.std(series.residual) == pytest.approx(NOISE, rel=0.1)
    h = data.histories[0]
    assert series.turns[-1] == pytest.approx(np.sum(np.abs(h.driver) * h.dt), rel=0.01), "V s, where no rate is known"


def test_a_delay_is_in_the_residual_at_every_sample():
    late = noisy(change=lambda t, _V, F: np.interp(t - 0.1, t, F))
    data, estimate = known_noise({TimeSkew(): (0.09,)}, [late])
    (series,) = series_of(estimate.fit, data)
    plain_data, plain = known_noise({}, [late])
    (bare,) = series_of(plain.fit, plain_data)
    assert np.std(series.residual) < 0.5 * np.std(bare.residual)


def test_the_angle_is_that_of_when_the_force_was():
    data, estimate = known_noise({TimeSkew(): (0.0,)}, [noisy()])
    now = estimate.fit
    (plain,) = series_of(replace(now, theta=replace(now.theta, terms=((0.0,),))), data)
    (late,) = series_of(replace(now, theta=replace(now.theta, terms=((0.09,),), shift=0.01)), data)
    before = np.interp(plain.time - 0.1, plain.time, plain.turns)
    assert late.turns[5:] == pytest.approx(before[5:], abs=0.25)
    assert np.max(plain.turns - late.turns) > 0.5, "at 9 V"


def test_a_shift_of_the_clocks_is_in_it_too():
    """Forty milliseconds between command and force, as a nuisance and as a delay: the same residual."""
    data, estimate = known_noise({TimeSkew(): (0.0,)}, [noisy()])
    now = estimate.fit
    late = replace(now, theta=replace(now.theta, terms=((0.04,),)))
    shifted = replace(now, theta=replace(now.theta, terms=((0.0,),), shift=0.04))
    (one,), (other,) = series_of(late, data), series_of(shifted, data)
    assert other.residual == pytest.approx(one.residual, abs=1e-6)
    (none,) = series_of(replace(now, theta=replace(now.theta, terms=((0.0,),))), data)
    assert np.max(np.abs(other.residual - none.residual)) > 1.0


def test_a_line_is_taken_from_every_sample_and_its_mean():
    data, estimate = estimated({}, [noisy(change=hum())])
    found = stage.run(estimate.fit, data, data.histories)
    (line,) = found.lines
    assert (line.kind, line.frequency) == ("fixed", pytest.approx(4.0, abs=4 * line.frequency_std))
    assert line.amplitude == pytest.approx(1.0, abs=4 * line.amplitude_std)
    assert found.changed
    clean, loud = found.histories[0], data.histories[0]
    wave = np.sin(2 * np.pi * 4.0 * loud.sample_time + 1.0)
    assert loud.sample_thrust - clean.sample_thrust == pytest.approx(wave, abs=0.1)
    inside = np.searchsorted(loud.edges, loud.sample_time, side="right") - 1
    some = loud.count > 0
    mean = np.bincount(inside, clean.sample_thrust, loud.count.size)[some] / loud.count[some]
    assert clean.thrust[some] == pytest.approx(mean)
    squares = np.bincount(inside, (clean.sample_thrust - clean.thrust[inside]) ** 2, loud.count.size)
    assert clean.within == pytest.approx(squares, abs=1e-9)


@pytest.mark.parametrize(("apart", "found"), [(5.0, 0), (40.0, 2)])
def test_two_waves_within_a_few_turns_of_the_run_are_a_peak_of_the_noise(apart, found):
    duration = float(np.ptp(noisy().first_of("thrust").time))
    data, estimate = estimated({}, [noisy(change=lambda t, V, F: hum(4.0 + apart / duration)(t, V, hum(4.0)(t, V, F)))])
    assert len(stage.run(estimate.fit, data, data.histories).lines) == found


@pytest.mark.parametrize("lasts", [0.1, 0.05])
def test_what_comes_again_after_each_step_is_no_wave(lasts):
    """Thrust that overshoots for a tenth of a second, which no term has: the rest of the run has no wave of 1.6 Hz."""
    start, _ = levels(0, 150.0)

    def overshoots(t, V, F):
        since = t - np.concatenate([[-9.0], start])[np.searchsorted(start, t)]
        return F + F * np.exp(-since / lasts) * np.sin(2 * np.pi * 0.4 * np.abs(V) * since)

    data, estimate = known_noise({}, [run(overshoots, rate=50.0)])
    assert find_lines(series_of(estimate.fit, data), turns_unit="V s"), "the spectrum has some"
    assert not stage.run(estimate.fit, data, data.histories).lines


def test_a_wave_that_is_there_stays_beside_what_comes_after_each_step():
    start, _ = levels(0, 150.0)

    def both(t, V, F):
        since = t - np.concatenate([[-9.0], start])[np.searchsorted(start, t)]
        return hum()(t, V, F + F * np.exp(-since / 0.1) * np.sin(2 * np.pi * 0.4 * np.abs(V) * since))

    data, estimate = known_noise({}, [run(both, rate=50.0)])
    (line,) = stage.run(estimate.fit, data, data.histories).lines
    assert line.frequency == pytest.approx(4.0, abs=0.002)


def test_runs_without_lines_are_handed_on_as_they_are():
    data, estimate = estimated({}, [noisy()])
    found = stage.run(estimate.fit, data, data.histories)
    assert (found.lines, found.bands, found.changed) == ((), (), False)
    assert found.histories[0] is data.histories[0]


def test_runs_of_few_samples_have_neither():
    data, estimate = estimated({}, [short(change=hum(), seconds=20.0, rate=10.0)])
    found = stage.run(estimate.fit, data, data.histories)
    assert not found.changed
    assert found.histories == data.histories


def test_a_line_in_two_runs_is_one_and_is_taken_from_both():
    data, estimate = estimated({}, [noisy(change=hum(), seed=s, seconds=50.0) for s in (0, 1)])
    found = stage.run(estimate.fit, data, data.histories)
    (line,) = found.lines
    assert {p.run for p in line.parts} == {0, 1}
    for clean, loud in zip(found.histories, data.histories, strict=True):
        assert np.std(loud.sample_thrust - clean.sample_thrust) == pytest.approx(np.sqrt(0.5), rel=0.15)


# ---------------------------------------------------------------- the scale of turns


def with_rate(noise=0.2):
    recording = noisy()
    command = recording.first_of("command_voltage")
    t = np.arange(0.01, 79.9, 0.05)
    n = 2.0 * np.nan_to_num(command.held_at(t)) + noise * rng(3).standard_normal(t.size)
    return replace(recording, channels=(*recording.channels, Channel("n", "esc", "rotation_rate", "rev/s", t, n)))


def test_turns_come_from_the_measured_rate_where_the_model_lacks_some_of_it():
    data, estimate = estimated({}, [with_rate()])
    (series,) = series_of(estimate.fit, data)
    command = with_rate().first_of("command_voltage")
    t = np.arange(0.0, 79.9, 0.001)
    true = np.sum(2.0 * np.abs(np.nan_to_num(command.held_at(t)))) * 0.001
    assert series.turns[-1] == pytest.approx(true, rel=0.01)


def test_the_scale_of_turns_has_the_error_of_the_rate_and_a_line_inherits_it():
    quiet, loud = (scale_std_of(e.fit, d) for d, e in (estimated({}, [with_rate(s)]) for s in (0.05, 1.0)))
    assert 10 * quiet < loud < 0.02
    line = Line("rotation", 30.0, 0.1, 3.0, 0.004, 1.0, 0.1, 0.5, 0.3, 1e-9, 100.0, "")
    data, estimate = estimated({}, [with_rate()])
    series = series_of(estimate.fit, data)
    found = with_scale(line, 0.001, series)
    assert found.ratio_std == pytest.approx(np.hypot(0.004, 3.0 * 0.001))
    turns = float(np.mean(series[0].turns))
    assert found.phase_std == pytest.approx(np.hypot(0.3, 2 * np.pi * 3.0 * 0.001 * turns))
    slipping = replace(line, phase=None, phase_std=None)
    assert with_scale(slipping, 0.001, series).phase_std is None
    fixed = replace(line, kind="fixed", ratio=None, ratio_std=None, rival=line)
    told = with_scale(fixed, 0.001, series)
    assert (told.frequency_std, told.rival.ratio_std) == (0.1, found.ratio_std)


@pytest.mark.parametrize(("digit", "kept"), [(0.0, 1), (8.0, 0)])
def test_a_wave_that_the_steps_of_a_reading_can_make_is_no_line(digit, kept):
    data, estimate = known_noise({}, [noisy(change=hum(size=0.5))])
    coarse = tuple(replace(h, quantum=digit) for h in data.histories)
    found = stage.run(estimate.fit, replace(data, histories=coarse), coarse)
    assert len(found.lines) == kept
