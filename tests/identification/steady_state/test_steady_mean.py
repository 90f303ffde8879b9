import numpy as np
import pytest
from scipy.stats import t as student

from identification.steady_state.steady import SteadyMonitor, mean_estimate, settled_estimates
from tests.identification.thrust_runs import ar1, white


@pytest.mark.parametrize("draw", [white, ar1(0.9)])
def test_drift_is_covered_and_false_alarms_are_rare(draw):
    t = np.arange(300) / 100
    inside, alarms = 0, 0
    for x in draw(np.random.default_rng(3), 300, 200):
        e = mean_estimate(t, x + 0.5 * t)
        inside += abs(e.drift - 0.5) <= student.ppf(0.975, e.drift_dof) * e.drift_std
        alarms += mean_estimate(t, x).drifting
    assert inside / 200 > 0.89
    assert alarms / 200 < 0.05


def test_a_strong_drift_is_seen():
    t = np.arange(300) / 100
    e = mean_estimate(t, 2 * t + np.random.default_rng(0).normal(0, 0.3, 300))
    assert e.drifting
    assert e.drift == pytest.approx(2, abs=0.1)


def test_few_samples_say_what_they_can():
    t = np.arange(3.0)
    assert np.isnan(mean_estimate(t, np.ones(3)).std_error)
    assert mean_estimate(t, np.ones(3), noise_std=0.3).std_error == pytest.approx(0.3 / np.sqrt(3))
    assert np.isnan(mean_estimate(np.empty(0), np.empty(0)).mean)
    few = mean_estimate(np.arange(6.0), np.array([1.0, 2, 1, 2, 1, 2]))
    assert np.isfinite(few.std_error)
    assert not few.drifting


def test_constant_samples_are_known_exactly():
    e = mean_estimate(np.arange(50.0), np.full(50, 2.0))
    assert (e.mean, e.std_error, e.n_effective) == (2.0, 0.0, 50.0)


def test_windows_together_keep_their_order_and_short_ones():
    rng = np.random.default_rng(1)
    windows = [(np.arange(2.0), np.ones(2)), (np.arange(100.0), rng.normal(5, 1, 100))]
    first, second = settled_estimates(windows)
    assert (first.n, first.mean) == (2, 1.0)
    assert second.mean == pytest.approx(5, abs=0.5)


def test_monitor_in_blocks_equals_the_whole():
    rng = np.random.default_rng(2)
    t = np.arange(400) / 100
    x = 7 + rng.normal(0, 1, 400) - 30 * np.exp(-t / 0.1)
    blocks, single = SteadyMonitor(), SteadyMonitor()
    for k in range(0, 400, 2):
        blocks.add(t[k : k + 2], x[k : k + 2])
    for a, b in zip(t, x, strict=True):
        single.add(a, b)
    assert blocks.estimate() == single.estimate()
    assert blocks.mean == pytest.approx(7, abs=0.3)
    assert (blocks.std_error, blocks.drift, blocks.drift_std) == (
        blocks.estimate().std_error, blocks.estimate().drift, blocks.estimate().drift_std,
    )  # fmt: skip


def test_monitor_skips_nan_and_knows_nothing_when_empty():
    monitor = SteadyMonitor()
    assert np.isnan(monitor.mean)
    monitor.add(np.arange(3.0), np.array([1.0, np.nan, np.inf]))
    assert (monitor.skipped, monitor.estimate().n) == (2, 1)


def test_monitor_averages_neighbours_of_a_long_hold():
    monitor = SteadyMonitor()
    x = np.random.default_rng(3).normal(1, 1, 5000)
    monitor.add(np.arange(5000) / 1000, x)
    e = monitor.estimate()
    assert e.n <= 512
    assert e.std_error == pytest.approx(1 / np.sqrt(5000), rel=0.3)
