"""Samples beside a tick that are on its other side than the clocks say."""

import numpy as np
from scipy.signal import lfilter

from identification.mismatch.select.wrong_side import on_their_side
from identification.recording import Acquisition, Channel, Recording
from tests.identification.mismatch.small import history

TICK, LATE, C = 0.02, 0.002, 0.5


def ramps(lag=0.0, quick=(), every=0.0117, late=LATE, begin=0.1 + LATE):
    """Ramps in ticks of 2 % for 40 s, thrust 85 times a second and 2 ms late; of `quick` samples the command was 0.8 ms
    sooner. The recording's history, and the thrust of each sample."""
    rng = np.random.default_rng(1)
    when = TICK * np.arange(2000)
    volts = np.interp(when, np.arange(0.0, 41.0, 2.0), rng.choice([-10.0, -5.0, 5.0, 10.0], 21))
    volts = np.round(volts / 0.2) * 0.2
    t = np.arange(begin, 39.5, every)
    early = np.zeros(t.size)
    early[list(quick)] = 0.0008
    x = volts[np.searchsorted(when, t - late + early, side="right") - 1]
    F = C * x * np.abs(x)
    if lag:
        F = lfilter([every / lag], [1.0, every / lag - 1.0], F)
    F += 0.02 * rng.standard_normal(t.size)
    unsure = Acquisition(delay_std=0.002)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", when, volts, acquisition=unsure),
        Channel("thrust", "cell", "thrust", "N", t, F),
    )
    return history(Recording("ramps", "T1", channels, source="ramps.h5")), t, F


def dropped(h):
    (clear,) = on_their_side([h])
    return h.sampled[h.rows][~np.isin(h.rows, clear.rows)]


def from_a_tick(t):
    """s between what a sample at `t` saw and the tick nearest to it."""
    return np.abs((t - LATE + TICK / 2) % TICK - TICK / 2)


def test_a_sample_that_saw_a_tick_early_is_no_data():
    """Of 24 sigma one was something left after steps in a run in which nothing was left out."""
    _, t, F = ramps()
    _, _, sooner = ramps(quick=range(t.size))
    first, second, *_ = np.flatnonzero((np.abs(sooner - F) > 0.5) & (from_a_tick(t) > 0.0004))[4:]
    gone = dropped(ramps(quick=(first, second))[0])
    assert {t[first], t[second]} <= set(gone.tolist())
    assert np.max(from_a_tick(np.setdiff1d(gone, t[[first, second]]))) < 0.0004


def test_a_sample_that_the_clocks_put_on_either_side_is_no_data():
    """Of 25 sigma one was 0.01 ms from a tick, where the fitted clock had come to rest."""
    h, t, _ = ramps()
    gone = dropped(h)
    assert 0 < gone.size < 0.03 * t.size
    assert np.max(from_a_tick(gone)) < 0.0004


def test_samples_in_step_with_the_ticks_stay():
    h, *_ = ramps(every=TICK, late=0.0, begin=0.10005)
    assert dropped(h).size == 0


def test_where_many_are_off_it_is_not_the_side():
    assert dropped(ramps(lag=0.1)[0]).size == 0


def test_a_sample_that_saw_a_tick_early_takes_its_interval_along():
    """Of 7.4 sigma a mean of two was left, one of which had seen what came before."""
    h, t, F = ramps(every=0.0031)
    _, _, sooner = ramps(quick=range(t.size), every=0.0031)
    inside = np.searchsorted(h.edges, t, side="right") - 1
    clear = (np.abs(sooner - F) > 1.0) & (from_a_tick(t) > 0.0004) & (h.count[inside] > 1)
    first, second, *_ = np.flatnonzero(clear)
    late = ramps(quick=(first, second), every=0.0031)[0]
    (kept,) = on_their_side([late])
    assert {inside[first], inside[second]} <= set(np.setdiff1d(late.rows, kept.rows).tolist())


def test_a_rate_has_a_clock_of_its_own():
    """It comes 0.87 ms late, at two places between the ticks, and of two samples the command was quick: 57 sigma each
    were left, for a clock that had stayed at 0 made of a hundred others as many errors."""
    rng = np.random.default_rng(4)
    when = TICK * np.arange(2000)
    volts = np.round(np.interp(when, np.arange(0.0, 41.0, 2.0), rng.choice([-10.0, -5.0, 5.0, 10.0], 21)) / 0.2) * 0.2
    t = np.arange(0.1, 39.5, 0.05) + rng.uniform(0.0001, 0.0007, 788)
    late = np.full(t.size, 0.00087)
    moving = np.flatnonzero(np.abs(np.diff(volts[np.searchsorted(when, t) + np.array([[-2], [-1]])], axis=0)[0]) > 0.1)
    near = moving[t[moving] % TICK < 0.0015]
    late[near[[3, 20]]] = 0.0
    n = 1.3 * volts[np.searchsorted(when, t - late, side="right") - 1] + 0.004 * rng.standard_normal(t.size)
    force = np.arange(0.1, 39.5, 0.0117)
    V = volts[np.searchsorted(when, force, side="right") - 1]
    unsure = Acquisition(delay_std=0.002)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", when, volts, acquisition=unsure),
        Channel("thrust", "cell", "thrust", "N", force, C * V * np.abs(V) + 0.02 * rng.standard_normal(force.size)),
        Channel("rotation_rate", "drive", "rotation_rate", "rev/s", t, n),
    )
    h = history(Recording("ramps", "T1", channels, source="ramps.h5"))
    (clear,) = on_their_side([h])
    gone = h.rate_sampled[np.setdiff1d(h.rate_rows, clear.rate_rows)]
    assert set(t[near[[3, 20]]]) <= set(gone)
