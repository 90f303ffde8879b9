"""Stamps brought back to the samples: an even clock under late arrivals, stated delays, and what is left alone."""

from __future__ import annotations

import numpy as np
import pytest

from identification.mismatch.prepare.chain.acquisition import as_sampled
from identification.mismatch.prepare.chain.sample_clock import sample_times
from identification.recording import Acquisition, Channel, Recording

PERIOD = 1 / 92


def arrivals(n=3000, period=PERIOD, seed=0, stall=0.0):
    """True times of an even clock, and when its rows came: mostly at once, some late, none early."""
    rng = np.random.default_rng(seed)
    true = 3.2 + period * np.arange(n)
    late = rng.exponential(0.0008, n) * (rng.random(n) < 0.7)
    came = true + late
    if stall:
        held = (true > 12.0) & (true < 12.0 + stall)
        came[held] = 12.0 + stall
    return true, np.maximum.accumulate(came)


def channel(time, value=None, **how):
    value = np.zeros(time.size) if value is None else value
    return Channel("thrust", "cell", "thrust", "N", time, value, acquisition=Acquisition(**how))


def test_late_rows_are_put_back_on_the_clock():
    true, came = arrivals()
    assert np.max(np.abs(sample_times(came, PERIOD) - true)) < 1e-4


def test_a_clock_that_runs_at_another_rate_than_it_says_is_followed():
    true, came = arrivals(period=PERIOD * 1.004)
    assert np.max(np.abs(sample_times(came, PERIOD) - true)) < 1e-4


def test_rows_that_come_together_after_a_stall_are_told_apart():
    true, came = arrivals(stall=0.15)
    assert np.max(np.abs(sample_times(came, PERIOD) - true)) < 1e-4


def test_rows_that_are_lost_leave_a_gap_of_whole_periods():
    true, came = arrivals()
    kept = np.ones(true.size, dtype=bool)
    kept[[400, 401, 1700, 2500]] = False
    assert np.max(np.abs(sample_times(came[kept], PERIOD) - true[kept])) < 1e-4


def test_what_is_late_at_the_very_end_is_not_lost():
    true, came = arrivals()
    came[-3:] += 0.007
    assert np.max(np.abs(sample_times(came, PERIOD) - true)) < 1e-4


def test_a_device_that_was_started_again_has_its_clock_at_another_phase():
    true, came = arrivals()
    true[1500:] += 4.0031
    came[1500:] += 4.0031
    assert np.max(np.abs(sample_times(came, PERIOD) - true)) < 1e-4


def test_times_do_not_run_backwards():
    _, came = arrivals(stall=0.3)
    assert np.all(np.diff(sample_times(came, PERIOD)) >= 0)


@pytest.mark.parametrize("seed", range(3))
def test_a_host_that_asks_when_it_likes_has_no_clock(seed):
    rng = np.random.default_rng(seed)
    time = np.cumsum(PERIOD * rng.exponential(1.0, 3000))
    assert sample_times(time, PERIOD) is None


def test_another_rate_than_stated_is_no_clock():
    _, came = arrivals(period=PERIOD * 1.1)
    assert sample_times(came, PERIOD) is None


def test_a_stated_delay_and_half_a_window_are_taken_off():
    time = np.arange(10.0)
    recording = Recording("r", "T", (channel(time, delay=0.02, window=0.1),))
    (moved, told) = as_sampled(recording)
    assert moved.channels[0].time == pytest.approx(time - 0.07)
    assert told == ("cell: thrust 70 ms before its stamp, as stated",)


def test_a_low_pass_stays_in_the_thrust_for_a_model_to_predict():
    time = np.arange(10.0)
    (moved, _) = as_sampled(Recording("r", "T", (channel(time, delay=0.02, low_pass=0.008, window=0.1),)))
    assert moved.channels[0].time == pytest.approx(time - 0.062)


def test_nothing_is_moved_where_nothing_is_said():
    _, came = arrivals()
    recording = Recording("r", "T", (channel(came),))
    moved, told = as_sampled(recording)
    assert moved.channels[0] is recording.channels[0]
    assert told == ()


def test_a_stream_whose_rows_do_not_tick_stays_and_is_told():
    rng = np.random.default_rng(0)
    time = np.cumsum(PERIOD * rng.exponential(1.0, 3000))
    moved, told = as_sampled(Recording("r", "T", (channel(time, period=PERIOD, clock_drift_std=1e-4),)))
    assert np.array_equal(moved.channels[0].time, time)
    assert "stay where they were stamped" in told[0]


def test_channels_of_one_stream_share_its_clock_and_have_their_own_delays():
    true, came = arrivals()
    one = channel(came, period=PERIOD, clock_drift_std=1e-4, delay=0.005)
    other = Channel(
        "stable", "cell", None, "1", came, 0 * came, acquisition=Acquisition(period=PERIOD, clock_drift_std=1e-4)
    )
    moved, told = as_sampled(Recording("r", "T", (one, other)))
    assert np.max(np.abs(moved.channels[0].time + 0.005 - true)) < 1e-4
    assert np.max(np.abs(moved.channels[1].time - true)) < 1e-4
    assert told[0].startswith("cell: put on its own clock (rows came up to ")


def test_values_that_were_cut_toward_zero_get_half_a_step_back():
    true = np.linspace(-3.0, 3.0, 6001)
    cut = 0.1 * np.trunc(true / 0.1)
    whole = Recording("a", "T1", (channel(np.arange(true.size) * 0.01, cut, quantum=0.1, rounding="toward_zero"),))
    found, (told,) = as_sampled(whole)
    far = np.abs(true) > 0.1
    for side in (-1.0, 1.0):
        which = far & (np.sign(true) == side)
        assert np.mean(found.channels[0].value[which] - true[which]) == pytest.approx(0.0, abs=1e-3)
    assert "half a step from zero" in told
    plain = Recording("a", "T1", (channel(np.arange(true.size) * 0.01, cut, quantum=0.1),))
    assert as_sampled(plain) == (plain, ())
