"""Filters on intervals against what their formulas say, step by step; spectra against scipy.signal."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import welch

from identification.mismatch.periodic.spectrum import averaged, smoothed
from identification.run_history.filters import (
    ShortDelay,
    delay_of,
    delayed,
    integral,
    lowpass,
    play,
    reconstructed,
    recursion,
)
from identification.run_history.rotor_lag import Rotor, lag


def _play(value, width):
    y, out = 0.0, []
    for v in value:
        y = min(max(y, v - width), v + width)
        out.append(y)
    return np.array(out)


@pytest.mark.parametrize("width", [0.0, 0.3, 2.0, 50.0])
def test_play_steps_once_a_turn_and_says_the_same(width):
    rng = np.random.default_rng(1)
    wandering = np.cumsum(rng.normal(size=2000))
    held = np.repeat(rng.normal(size=40) * 5, 25) + 1e-16 * rng.normal(size=1000)
    slow = 10 * np.sin(np.linspace(0, 20, 3000))
    for value in (wandering, held, slow, held[:1], np.full(5, 3.0), np.zeros(4)):
        np.testing.assert_allclose(play(value, width), _play(value, width), atol=1e-11)


def test_recursion_is_the_loop():
    rng = np.random.default_rng(2)
    keep, push = rng.uniform(0, 1, 500), rng.normal(size=500)
    y, expected = 0.7, []
    for k, p in zip(keep, push, strict=True):
        y = k * y + p
        expected.append(y)
    before = push.copy()
    np.testing.assert_allclose(recursion(keep, push, 0.7), expected, rtol=1e-12)
    np.testing.assert_array_equal(push, before)


@pytest.mark.parametrize("tau", [1e-3, 1.0, 1e4])
def test_lowpass_is_exact_for_a_step(tau):
    dt = np.full(200, 0.05)
    end, mean = lowpass(np.ones(200), dt, tau)
    t = np.cumsum(dt)
    np.testing.assert_allclose(end, -np.expm1(-t / tau), rtol=1e-10)
    exact = 1 - tau / dt * (np.exp(-(t - dt) / tau) - np.exp(-t / tau))
    np.testing.assert_allclose(mean, exact, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize(("quadratic", "linear"), [(0.5, 0.0), (0.0, 2.0), (0.2, 1.0)])
def test_lag_follows_its_differential_equation(quadratic, linear):
    w = np.concatenate([np.full(300, 6.0), np.full(300, -4.0), np.zeros(300)])
    fine, n, expected = 20, 0.0, []
    for v in w:
        total = 0.0
        for _ in range(fine):  # Heun's rule, steps of half a millisecond
            total += n
            h = 0.01 / fine
            slope = quadratic * (v * abs(v) - n * abs(n)) + linear * (v - n)
            m = n + h * slope
            n += 0.5 * h * (slope + quadratic * (v * abs(v) - m * abs(m)) + linear * (v - m))
        expected.append(total / fine)
    found = lag(w, np.full(900, 0.01), Rotor(quadratic, linear))[1]
    np.testing.assert_allclose(found, expected, atol=0.03)


def test_reconstructed_takes_the_smaller_slope():
    middle = np.arange(5.0)
    mean = np.array([0.0, 1.0, 3.0, 2.0, 2.0])
    np.testing.assert_allclose(reconstructed(mean, middle, middle + 0.25), [0.0, 1.25, 3.0, 2.0, 2.0])


@pytest.mark.parametrize("segment", [64, 255, 1000])
def test_averaged_is_welch(segment):
    value = np.cumsum(np.random.default_rng(3).normal(size=5000))
    f, density = welch(value, fs=50.0, nperseg=segment)
    g, found = averaged(value, 50.0, segment)
    np.testing.assert_allclose(g, f)
    np.testing.assert_allclose(found, density, rtol=1e-9, atol=1e-12 * density.max())


@pytest.mark.parametrize("width", [0.4, 3.0, 40.0])
def test_smoothed_is_a_gaussian_filter(width):
    value = np.random.default_rng(4).normal(size=777) + 5.0
    np.testing.assert_allclose(smoothed(value, width), gaussian_filter1d(value, width, mode="nearest"), rtol=1e-10)


@pytest.mark.parametrize("delay", [-3.0, -0.02, -0.004, 0.0, 0.004, 0.02, 3.0])
def test_delayed_is_the_mean_of_what_was_earlier(delay):
    rng = np.random.default_rng(5)
    edges = np.concatenate([[1.0], 1.0 + np.cumsum(rng.uniform(0.005, 0.1, 300))])
    value = rng.normal(size=300)
    expected = np.diff(integral(value, edges, edges - delay)) / np.diff(edges)
    np.testing.assert_allclose(delayed(value, edges, delay), expected, atol=1e-9)
    few = isinstance(delay_of(edges, delay), ShortDelay)
    assert few == (abs(delay) < 1.0), "a delay that is shorter than most intervals is not integrated over all of them"
