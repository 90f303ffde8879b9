"""The filters behind the terms against solvers that know nothing of them."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.run_history import filters
from tests.identification.physics.one_term import integrated, steps
from tests.identification.physics.runs_on_intervals import uneven


@pytest.mark.parametrize("tau", [0.002, 0.1, 3.0, 300.0])
def test_lowpass_is_the_first_order_equation(tau):
    u, dt = steps(60)
    end, mean = filters.lowpass(u, dt, tau, start=2.0)
    ends, means = integrated(lambda y, v: [(v - y[0]) / tau], [2.0], u, dt)
    assert end == pytest.approx(ends[:, 0], abs=1e-7)
    assert mean == pytest.approx(means, abs=1e-7)


def test_lowpass_on_an_even_grid_is_a_recursive_filter():
    u = np.random.default_rng(4).standard_normal(5000)
    a = np.exp(-0.02 / 0.7)
    end, _ = filters.lowpass(u, np.full(u.size, 0.02), 0.7)
    assert end == pytest.approx(lfilter([1 - a], [1, -a], u), abs=1e-12)


@pytest.mark.parametrize(("frequency", "damping"), [(0.5, 0.02), (3.0, 0.3), (12.0, 0.9)])
def test_resonant_is_a_mass_on_a_spring(frequency, damping):
    u, dt = steps(50)
    w = 2 * np.pi * frequency
    mean = filters.resonant(u, dt, frequency, damping)
    _, means = integrated(lambda y, v: [y[1], w**2 * (v - y[0]) - 2 * damping * w * y[1]], [0.0, 0.0], u, dt)
    assert mean == pytest.approx(means, abs=1e-6)


@pytest.mark.parametrize("delay", [-7.3, -0.21, 0.0, 0.0013, 0.4, 100.0])
def test_delayed_is_the_overlap_of_shifted_intervals(delay):
    value, dt = steps(40)
    edges = 5.0 + np.concatenate([[0.0], np.cumsum(dt)])
    moved = edges + delay
    moved[0], moved[-1] = -1e9, 1e9  # held constant outside
    expected = []
    for a, b in pairwise(edges):
        shared = np.maximum(np.minimum(b, moved[1:]) - np.maximum(a, moved[:-1]), 0.0)
        expected.append(shared @ value / (b - a))
    assert filters.delayed(value, edges, delay) == pytest.approx(np.array(expected), abs=1e-9)


@pytest.mark.parametrize("width", [0.0, 0.7, 6.0, 50.0])
def test_play_is_moved_only_by_its_edges(width):
    u = np.random.default_rng(5).uniform(-10, 10, 300)
    y, expected = 0.0, []
    for v in u:
        if v - y > width:
            y = v - width
        elif y - v > width:
            y = v + width
        expected.append(y)
    got = filters.play(u, width)
    assert got == pytest.approx(np.array(expected), abs=1e-12)
    assert np.all(np.abs(got - u) <= width + 1e-12)
    assert np.array_equal(filters.play(np.repeat(u, 3), width), np.repeat(got, 3)), "play has no time of its own"


def opposite_by_hand(x, dt, turning):
    """One interval after the other, as the words say it."""
    out, t = [], 0.0
    sign = ended = began = 0
    other_end = {1: None, -1: None}
    for value, width in zip(x, dt, strict=True):
        now = 1 if value > turning else -1 if value < -turning else 0
        if now and now != sign:
            sign, began = now, t
        ended = other_end[-sign] if sign else None
        out.append((t + width / 2 - ended, t + width / 2 - began) if ended is not None else None)
        t += width
        if now:
            other_end[now] = t
    return out


def test_since_opposite_counts_from_the_last_turn_the_other_way():
    rng = np.random.default_rng(6)
    x = np.repeat(rng.choice([-5.0, -0.1, 0.0, 0.1, 4.0], 80), 4)
    x[:12] = 0.0
    dt = uneven(rng, x.size)
    since, began, known = filters.since_opposite(x, dt, 0.24)
    expected = opposite_by_hand(x, dt, 0.24)
    assert known.tolist() == [e is not None for e in expected]
    assert 0 < known.sum() < known.size
    for i in np.flatnonzero(known):
        assert (since[i], began[i]) == pytest.approx(expected[i], abs=1e-9)


def test_a_run_in_one_direction_has_no_opposite():
    assert not filters.since_opposite(np.array([0.0, 1.0, 2.0, 0.0]), np.ones(4), 0.1)[2].any()


def test_reconstructed_is_exact_on_a_line_and_flat_at_steps_and_peaks():
    rng = np.random.default_rng(7)
    edges = np.concatenate([[0.0], np.cumsum(uneven(rng, 60))])
    middle = 0.5 * (edges[1:] + edges[:-1])
    at = edges[:-1] + rng.uniform(0, 1, 60) * np.diff(edges)
    line = filters.reconstructed(3 * middle - 1, middle, at)
    assert line[1:-1] == pytest.approx(3 * at[1:-1] - 1)
    level = np.where(middle > middle[30], 5.0, 1.0)
    assert np.array_equal(filters.reconstructed(level, middle, at), level)
    peak = -np.abs(middle - middle[30])
    assert filters.reconstructed(peak, middle, at)[30] == peak[30]
    bent = filters.reconstructed(middle**2, middle, at)  # never beyond what both neighbours allow
    flat = np.minimum(np.diff(middle**2)[:-1] / np.diff(middle)[:-1], np.diff(middle**2)[1:] / np.diff(middle)[1:])
    assert bent[1:-1] == pytest.approx(middle[1:-1] ** 2 + flat * (at - middle)[1:-1])


def test_integral_is_held_constant_outside():
    edges = np.array([1.0, 2.0, 4.0])
    found = filters.integral(np.array([2.0, 3.0]), edges, np.array([-1.0, 1.0, 1.5, 4.0, 6.0]))
    assert found.tolist() == [-4.0, 0.0, 1.0, 8.0, 14.0]
