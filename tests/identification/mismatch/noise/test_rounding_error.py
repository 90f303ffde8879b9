"""Coarse steps of a reading: levels scatter by what rounding shifts their means, and bend no curve."""

from dataclasses import replace

import numpy as np
import pytest

from identification.mismatch import diagnose
from identification.mismatch.noise.rounding_error import level_variance, rounding_errors
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.select.baseline import level_error_factor
from tests.identification.diagnosed_runs import C, dead_band, run
from tests.identification.mismatch.small import data_of

STEP = 1.2
"""N: of 0.15 N of noise eight times, of 72 N one in sixty."""
QUIET = 0.15


def rounded(recording, step=STEP):
    """With a thrust in whole steps."""
    channels = tuple(
        replace(c, value=step * np.round(c.value / step)) if c.quantity == "thrust" else c for c in recording.channels
    )
    return replace(recording, channels=channels)


@pytest.mark.parametrize("noise", [0.02, 0.1, 0.2, 0.3])
def test_the_scatter_within_levels_tells_the_error_of_their_means(noise):
    rng = np.random.default_rng(3)
    levels = rng.uniform(-40, 40, 4000)
    read = np.round(levels[:, None] + noise * rng.standard_normal((levels.size, 400)))
    error = read.mean(axis=1) - levels
    found = level_variance(float(np.mean(read.var(axis=1, ddof=1))), 1.0)
    assert found == pytest.approx(float(np.mean(error**2)), rel=0.1, abs=2e-3)


def test_alike_readings_share_one_error_and_others_have_their_own():
    h = history_of(rounded(run(noise=QUIET)))
    found = rounding_errors(h, C)
    levels = np.unique(np.round(h.driver[found.any(axis=1)]))
    assert found.shape[1] == levels.size == 13
    for column in found.T:
        assert np.unique(np.round(h.driver[column > 0])).size == 1
    assert 0.1 * STEP < found.max() <= STEP / np.sqrt(12)


def test_noise_that_dithers_leaves_nothing():
    h = history_of(rounded(run(noise=STEP)))
    assert h.quantum == pytest.approx(STEP)
    assert rounding_errors(h, C).shape == (h.driver.size, 0)
    assert rounding_errors(history_of(run(noise=QUIET)), C).shape[1] == 0


def test_runs_share_no_error():
    data, _ = data_of([rounded(run(noise=QUIET, seed=seed)) for seed in (1, 2)])
    first, second = level_error_factor(data, C).thrust
    assert first.shape[1] == second.shape[1]
    assert not np.any(first.any(axis=0) & second.any(axis=0))


def test_where_the_reading_passes_over_steps_they_average_out():
    h = history_of(rounded(run(noise=QUIET)))
    turning = 12 * np.sin(0.4 * h.middle)
    found = rounding_errors(replace(h, driver=turning), C).max(axis=1)
    passed = np.abs(np.diff(C * turning * np.abs(turning))) / STEP
    passed = np.minimum(np.append(passed, passed[-1]), np.append(passed[0], passed))
    slow, quick = passed < 0.05, passed > 1
    assert min(slow.sum(), quick.sum()) > 20
    assert found[slow].max() > 0
    assert not found[quick].any()


def test_coarse_steps_bend_no_curve_and_hide_no_effect():
    for seed in range(2):
        clean = diagnose([rounded(run(noise=QUIET, seed=seed, tare=0.31))])
        assert clean.verdict == "adequate", clean.statement
    found = diagnose([rounded(run(noise=QUIET, volts=dead_band(1.0)))])
    assert "dead_band" in [f.effect for f in found.findings], found.statement
