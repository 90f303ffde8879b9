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


def test_levels_are_off_by_what_rounding_leaves_and_alike_ones_alike():
    h = history_of(rounded(run(noise=QUIET)))
    found = rounding_errors(h, C)
    rows = [int(np.flatnonzero(np.round(h.driver) == level)[3]) for level in range(-12, 13, 2)]
    common = found[rows] @ found[rows].T
    s = QUIET / STEP
    assert np.diag(common) == pytest.approx(level_variance((s**2 + 1 / 12) * STEP**2 - 0.028 * STEP**2, STEP), rel=0.3)
    assert np.count_nonzero(np.abs(common) > 1e-9) < 40, "levels some steps apart say nothing of each other"
    same = np.flatnonzero(np.round(h.driver) == 8)
    assert found[same] == pytest.approx(np.broadcast_to(found[same[3]], found[same].shape), abs=1e-9)


def test_within_a_step_the_error_goes_up_and_down():
    """Of readings that creep over steps: a quarter of one apart they are independent, half a one apart opposed."""
    h = history_of(rounded(run(noise=QUIET)))
    steps = np.linspace(4.0, 5.0, h.driver.size)
    found = rounding_errors(replace(h, driver=np.sqrt(steps * STEP / C)), C)
    size = np.linalg.norm(found, axis=1)
    apart = [int(share * h.driver.size) for share in (0.0, 0.02, 0.25, 0.5)]
    alike = found[apart] @ found[0] / (size[apart] * size[0])
    assert alike == pytest.approx([1.0, 0.99, 0.0, -1.0], abs=0.1)


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
