"""Spectra, the width of a peak and the angle of the rotor: beside sums, scipy's Welch and integrals written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.signal import welch
from scipy.stats import f as fisher

from identification.mismatch.periodic.line_width import peak_p_value
from identification.mismatch.periodic.resonances import find_bands
from identification.mismatch.periodic.rotor_angle import turned, turned_by_rate
from identification.mismatch.periodic.spectrum import (
    Series,
    averaged,
    clipped,
    family_wise,
    finite,
    level,
    smoothed,
    spacing_of,
    spectrum_of,
    tail,
    transform,
)
from tests.identification.mismatch.small import rng

N, DT = 4000, 0.02
T = DT * np.arange(N)


def ringing(frequency, quality, seed=1, n=N, dt=DT):
    """A damped oscillator driven by white noise, of standard deviation 1: small steps of its exact rotation."""
    w = 2 * np.pi * frequency
    p = complex(-w / (2 * quality), w * np.sqrt(1 - 1 / (4 * quality**2)))
    pushes = rng(seed).standard_normal((n, 2)) @ np.array([1.0, 1.0j])
    z, keep = np.empty(n, dtype=complex), np.exp(p * dt)
    now = 0j
    for i in range(n):
        now = keep * now + pushes[i]
        z[i] = now
    return z.real / np.std(z.real)


# ---------------------------------------------------------------- the transform and its noise


def test_the_transform_of_cells_is_the_sum_where_samples_lie_on_them():
    value = rng(1).standard_normal(300)
    found = transform(5.0 + 0.1 * np.arange(300), value, 0.1, 1024)
    f = np.arange(found.size) / (1024 * 0.1)
    direct = np.array([value @ np.exp(-2j * np.pi * x * 0.1 * np.arange(300)) for x in f])
    assert found == pytest.approx(direct, abs=1e-9)


@pytest.mark.parametrize("even", [True, False])
def test_the_power_of_a_line_is_where_it_is(even):
    """n a^2 / 4, less at most a tenth between two frequencies and what narrow cells lose."""
    at = T if even else np.sort(rng(2).uniform(0, T[-1], N))
    found = spectrum_of(Series(at, 2.0 * np.sin(2 * np.pi * 7.3 * at)), 80.0, DT, even=even)
    top = int(np.argmax(found.power))
    assert found.step * top == pytest.approx(7.3, abs=0.01)
    assert found.power[top] == pytest.approx(N * 4 / 4, rel=0.16)


def test_the_noise_is_that_of_white_noise_and_a_line_does_not_move_it():
    quiet = Series(T, 0.5 * rng(3).standard_normal(N))
    loud = Series(T, quiet.residual + 3.0 * np.sin(2 * np.pi * 10 * T))
    levels = [spectrum_of(s, 80.0, DT, even=True).noise for s in (quiet, loud)]
    assert np.mean(levels[0]) == pytest.approx(0.25, rel=0.15)
    assert np.median(levels[1] / levels[0]) == pytest.approx(1.0, abs=0.2)


def test_the_level_follows_a_slope():
    """Median over ln 2 of exponential variates whose mean falls a thousandfold."""
    f = np.linspace(0, 1, 6000)
    mean = 10.0 ** (-3 * f)
    found = level(mean * rng(4).exponential(size=f.size), 1.0)
    assert np.max(np.abs(np.log(found / mean))) < 0.8
    assert abs(np.mean(np.log(found / mean))) < 0.3


def test_averaged_spectra_are_welchs():
    x = ringing(5.0, 4.0)
    f, density = averaged(x, 1 / DT, 500)
    theirs_f, theirs = welch(x, 1 / DT, "hann", 500, detrend="constant")
    assert f == pytest.approx(theirs_f)
    assert density[1:] == pytest.approx(theirs[1:], rel=1e-6)


def test_the_gauss_mean_is_scipys():
    x = rng(5).standard_normal(700)
    assert smoothed(x, 9.0) == pytest.approx(gaussian_filter1d(x, 9.0, mode="nearest"), abs=1e-9)


def test_chances_are_those_of_fisher_and_of_many_trials():
    assert tail(9.0, 2, 96) == pytest.approx(fisher.sf(9.0, 4, 2 * 0.48 * 96 * 2), rel=1e-6)
    single = np.exp(-12.0)
    assert family_wise(single, 12.0, 1000.0) == pytest.approx(single * 1000 * np.sqrt(12), rel=0.02)
    assert family_wise(0.5, 1.0, 1e6) == pytest.approx(1.0)


def test_outliers_are_cut_and_what_is_no_number_left_out():
    x = rng(6).standard_normal(500)
    x[7] = 1e9
    assert np.max(np.abs(clipped(x))) < 20
    assert clipped(np.zeros(5)).tolist() == [0.0] * 5
    t = np.array([0.0, 1.0, 1.0, 2.0, 3.0])
    found = finite(Series(t, np.array([1.0, 2.0, 3.0, np.nan, 5.0]), t))
    assert (found.time.tolist(), found.residual.tolist()) == ([0.0, 1.0, 3.0], [1.0, 2.0, 5.0])


def test_the_spacing_of_a_grid_with_gaps_is_even_and_of_others_not():
    gappy = np.delete(T, slice(100, 900))
    assert spacing_of(gappy) == (pytest.approx(DT, rel=1e-6), True)
    jittered = T + 0.3 * DT * rng(7).uniform(-1, 1, N)
    spacing, even = spacing_of(jittered)
    assert spacing == pytest.approx(DT, rel=0.01)
    assert not even


# ---------------------------------------------------------------- line or resonance


def test_a_line_is_narrow_and_a_resonance_of_noise_is_not():
    """Both as loud as the noise beside them."""
    white = rng(8).standard_normal(N)
    line = white + 0.5 * np.sin(2 * np.pi * 6.0 * T + 1)
    assert peak_p_value(T, line, 6.0) < 1e-8
    for seed in range(4):
        peak = 0.3 * rng(seed + 20).standard_normal(N) + ringing(6.0, 60.0, seed)
        power = [abs(peak @ np.exp(-2j * np.pi * f * T)) for f in np.linspace(5.8, 6.2, 200)]
        assert peak_p_value(T, peak, float(np.linspace(5.8, 6.2, 200)[int(np.argmax(power))])) > 1e-4


def test_a_resonance_is_found_with_its_frequency_and_quality():
    for seed in range(3):
        series = Series(T, ringing(6.0, 8.0, seed) + 0.3 * rng(seed + 50).standard_normal(N))
        ((frequency, quality),) = find_bands([series])
        assert frequency == pytest.approx(6.0, rel=0.05)
        assert quality == pytest.approx(8.0, rel=0.5)


def test_white_and_slow_noise_have_no_resonance():
    for seed in range(4):
        e = rng(seed).standard_normal(N)
        slow = np.convolve(e, np.exp(-T[:500] / 0.5))[:N]
        assert find_bands([Series(T, e)]) == ()
        assert find_bands([Series(T, slow / np.std(slow) + 0.2 * e)]) == ()
    assert find_bands([Series(T[:50], e[:50])]) == ()


# ---------------------------------------------------------------- the angle


def test_the_angle_is_the_integral_of_the_size_of_the_speed():
    edges = np.array([0.0, 1.0, 3.0, 4.0])
    speed = np.array([2.0, -3.0, 0.0])
    at = np.linspace(-0.0, 4.0, 41)
    fine = np.linspace(0.0, 4.0, 400_001)
    middle = 0.5 * (fine[1:] + fine[:-1])
    total = np.concatenate([[0.0], np.cumsum(np.abs(speed[np.searchsorted(edges, middle) - 1]) * np.diff(fine))])
    assert turned(edges, speed, at) == pytest.approx(np.interp(at, fine, total), abs=1e-4)
    assert np.all(np.diff(turned(edges, speed, at)) >= 0)


def test_the_angle_of_a_measured_rate_is_that_of_straight_lines():
    t = np.sort(rng(9).uniform(0, 20, 80))
    n = 5 + 3 * np.sin(t)
    n[10] = np.nan
    good = np.isfinite(n)
    at = np.linspace(t[0], t[-1], 57)
    fine = np.linspace(t[0], t[-1], 200_001)
    line = np.interp(0.5 * (fine[1:] + fine[:-1]), t[good], n[good])
    total = np.concatenate([[0.0], np.cumsum(line * np.diff(fine))])
    assert turned_by_rate(t, n, at) == pytest.approx(np.interp(at, fine, total), abs=1e-3)
