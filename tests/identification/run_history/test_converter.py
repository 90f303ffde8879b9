"""What a low pass and a window make of a staircase, against a course worked out in tenths of a millisecond."""

import numpy as np
import pytest

from identification.run_history.converter import Converter, Mode

FINE = 1e-5
EDGES = np.array([0.0, 0.01, 0.013, 0.05, 0.07, 0.08, 0.2])
VALUE = np.array([1.0, 4.0, -2.0, 0.5, 3.0, 1.0])


def course(converter):
    """Times and what stands behind the low pass then."""
    t = np.arange(-0.2, 0.4, FINE)
    u = VALUE[np.clip(np.searchsorted(EDGES, t, side="right") - 1, 0, VALUE.size - 1)]
    if not converter.low_pass:
        return t, u
    y, keep = np.full(t.size, VALUE[0]), np.exp(-FINE / converter.low_pass)
    for i in range(1, t.size):
        y[i] = keep * y[i - 1] + (1 - keep) * u[i - 1]
    return t, y


@pytest.mark.parametrize(
    "converter", [Converter(0.02), Converter(0.0, 0.005), Converter(0.012, 0.005), Converter(0.05, 0.02)]
)
def test_a_sample_is_the_mean_of_what_the_low_pass_lets_through(converter):
    at = np.array([0.004, 0.012, 0.031, 0.0715, 0.11, 0.19])
    t, y = course(converter)
    half = 0.5 * converter.window
    expected = [np.mean(y[(t >= a - half) & (t < a + half)]) if half else np.interp(a, t, y) for a in at]
    shown = converter.shown(VALUE, np.diff(EDGES), converter.places(EDGES, at))
    assert shown == pytest.approx(np.array(expected), abs=6e-3)


@pytest.mark.parametrize(
    "converter", [Converter(0.02), Converter(0.0, 0.005), Converter(0.012, 0.005), Converter(0.05, 0.02)]
)
def test_what_decays_or_rings_between_two_knots_is_as_exact(converter):
    at = np.array([0.004, 0.012, 0.031, 0.0715, 0.11, 0.19])
    rate, pole = np.full(VALUE.size, 200.0), np.full(VALUE.size, 15 - 250j)
    size = np.array([2.0, -1.0, 3.0, 0.5, -2.0, 1.0])
    modes = (Mode(size, rate), Mode(1j * size, pole))
    t, _ = course(Converter())
    i = np.clip(np.searchsorted(EDGES, t, side="right") - 1, 0, VALUE.size - 1)
    since = np.maximum(t - EDGES[i], 0.0)
    u = VALUE[i] + np.where(t >= 0, modes[0].at(since, i) + modes[1].at(since, i), 0.0)
    y, keep = u.copy(), np.exp(-FINE / converter.low_pass) if converter.low_pass else 0.0
    y[0] = VALUE[0]
    for k in range(1, t.size):
        y[k] = keep * y[k - 1] + (1 - keep) * u[k]
    half = 0.5 * converter.window
    expected = [np.mean(y[(t >= a - half) & (t < a + half)]) if half else np.interp(a, t, y) for a in at]
    late = at[at - half > 0] if half else at  # before the first knot a mode is not what it is here
    shown = converter.shown(VALUE, np.diff(EDGES), converter.places(EDGES, late), modes)
    assert shown == pytest.approx(np.array(expected)[-late.size :], abs=1e-2)


def test_a_mode_as_fast_as_the_low_pass_is_no_exception():
    """tau s e^(-s / tau) in place of a difference over nothing."""
    since = np.array([0.001, 0.004])
    near, there = (Mode(np.ones(2), np.full(2, r)).behind(0.005, since) for r in (200.0 * 1.001, 200.0))
    assert there == pytest.approx(since / 0.005 * np.exp(-since / 0.005))
    assert near == pytest.approx(there, rel=2e-3)


def test_an_instant_is_what_there_is():
    assert Converter().instant
    assert not Converter(0.01).instant
    assert not Converter(0.0, 0.01).instant
