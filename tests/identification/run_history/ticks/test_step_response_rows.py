"""Rows of the response to ticks are in units of their own noise."""

import numpy as np

from identification.recording import Acquisition, Channel, Recording
from identification.run_history.ticks.step_response_rows import tick_rows
from tests.identification.mismatch.small import history

TICK, C = 0.02, 0.5


def sine(seed):
    """A sine of 80 s in ticks of 20 ms; thrust of white noise, 92 times a second: few intervals have two samples."""
    rng = np.random.default_rng(seed)
    when = TICK * np.arange(4000)
    volts = 10.0 * np.sin(2 * np.pi * when / 32.0)
    t = np.arange(0.1, 79.5, 1 / 92.0)
    x = volts[np.searchsorted(when, t, side="right") - 1]
    F = C * x * np.abs(x) + 0.05 * rng.standard_normal(t.size)
    unsure = Acquisition(delay_std=0.002)
    channels = (
        Channel("command_voltage", "command", "command_voltage", "V", when, volts, acquisition=unsure),
        Channel("thrust", "cell", "thrust", "N", t, F),
    )
    return history(Recording("sine", "T1", channels, source="sine.h5"))


def chi_square_per_row(rows):
    told = rows.predicted(C, np.zeros(rows.nodes.size - 1))
    return float(np.mean((rows.target - told) ** 2))


def test_few_samples_to_an_interval_leave_rows_of_unit_noise():
    """A mean taken out of two samples leaves one: 63 rows had a chi-square of 143 where nothing was left out."""
    found = [tick_rows(sine(seed)) for seed in range(8)]
    assert 0.7 < np.mean([chi_square_per_row(rows) for rows in found]) < 1.15
