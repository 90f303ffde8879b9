"""Samples beside a tick that are on its other side than the clocks say."""

import numpy as np
from scipy.signal import lfilter

from identification.mismatch.select.wrong_side import on_their_side
from identification.recording import Acquisition, Channel, Recording
from tests.identification.mismatch.small import history

TICK, LATE, C = 0.02, 0.002, 0.5


def ramps(lag=0.0, quick=()):
    """Ramps in ticks of 2 % for 40 s, thrust 85 times a second and 2 ms late; of `quick` samples the command was 0.8 ms
    sooner. The recording's history, and the thrust of each sample."""
    rng = np.random.default_rng(1)
    when = TICK * np.arange(2000)
    volts = np.interp(when, np.arange(0.0, 41.0, 2.0), rng.choice([-10.0, -5.0, 5.0, 10.0], 21))
    volts = np.round(volts / 0.2) * 0.2
    t = np.arange(0.1, 39.5, 0.0117)
    early = np.zeros(t.size)
    early[list(quick)] = 0.0008
    x = volts[np.searchsorted(when, t - LATE + early, side="right") - 1]
    F = C * x * np.abs(x)
    if lag:
        F = lfilter([0.0117 / lag], [1.0, 0.0117 / lag - 1.0], F)
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


def test_a_sample_that_saw_a_tick_early_is_no_data_and_all_others_are():
    """Of 24 sigma one was something left after steps in a run in which nothing was left out."""
    h, t, F = ramps()
    _, _, sooner = ramps(quick=range(t.size))
    first, second, *_ = np.flatnonzero(np.abs(sooner - F) > 0.5)[4:]
    assert dropped(h).size == 0
    assert dropped(ramps(quick=(first, second))[0]).tolist() == [t[first], t[second]]


def test_where_many_are_off_it_is_not_the_side():
    assert dropped(ramps(lag=0.1)[0]).size == 0
