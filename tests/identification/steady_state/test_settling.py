import numpy as np
import pytest

from identification.steady_state.settling import exponential_cut, mser_cut, settle
from tests.identification.thrust_runs import ar1


def decay(n, amplitude, tau, sigma=1.0, seed=0):
    return amplitude * np.exp(-np.arange(n) / tau) + sigma * np.random.default_rng(seed).normal(size=n)


@pytest.mark.parametrize(("amplitude", "tau"), [(30, 8), (300, 8), (300, 20), (-50, 5)])
def test_what_is_left_of_a_transient_is_below_the_standard_error(amplitude, tau):
    n = 400
    cut = settle(decay(n, amplitude, tau)).cut
    bias = abs(amplitude) * np.exp(-cut / tau) * tau / (n - cut)
    assert bias < 0.3 / np.sqrt(n - cut)


def test_pure_noise_is_left_whole():
    rng = np.random.default_rng(1)
    cuts = [settle(rng.normal(size=200)).cut for _ in range(200)]
    assert np.mean(np.array(cuts) > 0) < 0.1


def test_correlated_noise_costs_little():
    cuts = [settle(x).cut for x in ar1(0.9)(np.random.default_rng(2), 400, 200)]
    assert np.mean(cuts) < 0.1 * 400


def test_overshoot_is_cut_by_mser():
    n, i = 300, np.arange(300)
    ringing = 20 * np.exp(-i / 10) * np.cos(i / 2) + np.random.default_rng(3).normal(size=n)
    assert mser_cut(ringing) >= 15


def test_a_hold_that_never_settles_says_so():
    assert not settle(decay(100, 300, 60)).settled
    late = np.where(np.arange(100) < 50, 10.0, 0.0) + 0.1 * np.random.default_rng(0).normal(size=100)
    assert not settle(late).settled


def test_tiny_holds_are_left_alone():
    assert settle(np.array([1.0, 2.0])).cut == 0
    assert exponential_cut(np.arange(5.0)) == (0, None)
    assert settle(np.full(50, 2.0)) == settle(np.full(50, 7.0))


def test_noise_free_exponential_is_cut_and_its_constant_found():
    result = settle(5 + 10 * np.exp(-np.arange(600) / 12))
    assert result.time_constant == pytest.approx(12, rel=0.25)
    assert 60 < result.cut < 450
