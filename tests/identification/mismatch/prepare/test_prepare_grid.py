"""Intervals of a run and the driver in them, beside the driver integrated in tiny steps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.mismatch.prepare.grid import Held, distinct, edges_of
from identification.recording import Channel
from tests.identification.mismatch.small import rng


def command(time, value):
    return Channel("u", "drive", "command_voltage", "V", np.asarray(time, float), np.asarray(value, float))


def measured(time, value):
    return Channel("n", "drive", "rotation_rate", "rev/s", np.asarray(time, float), np.asarray(value, float))


def finely(of, low, high, parts=20_000):
    """Mean of a function over an interval, by the midpoint rule."""
    at = low + (np.arange(parts) + 0.5) * (high - low) / parts
    return float(np.mean(of(at)))


@st.composite
def plans(draw):
    gaps = draw(st.lists(st.floats(0.05, 3.0), min_size=3, max_size=8))
    values = draw(st.lists(st.floats(-20.0, 20.0), min_size=len(gaps), max_size=len(gaps)))
    return np.cumsum(gaps), np.array(values)


@settings(max_examples=25, deadline=None)
@given(plans(), st.integers(2, 6))
def test_means_of_a_command_are_those_of_what_is_held(plan, parts):
    time, value = plan
    if not np.any(value):
        return
    held = Held(command(time, value), float(time[-1] + 2.0))
    edges = np.linspace(time[0], time[-1] + 1.0, parts + 1)

    def at(t):
        return value[np.maximum(np.searchsorted(time, t, side="right") - 1, 0)]

    pairs = list(pairwise(edges))
    size = float(np.max(np.abs(value)))
    mean = np.array([finely(at, *pair) for pair in pairs])
    assert held.mean(edges) == pytest.approx(mean, abs=2e-3 * size)
    square = np.array([finely(lambda t: at(t) * np.abs(at(t)), *pair) for pair in pairs])
    assert held.excess(edges) == pytest.approx(square - mean * np.abs(mean), abs=6e-3 * size**2)


def test_means_of_a_measurement_are_those_of_straight_lines():
    time = np.arange(0.0, 5.0, 0.05)
    value = 4.0 * np.sin(time) + 0.3 * time
    held = Held(measured(time, value), 5.0)
    edges = np.array([0.1, 0.7, 1.9, 3.3, 4.4])
    pairs = list(pairwise(edges))

    def at(t):
        return np.interp(t, time, value)

    mean = np.array([finely(at, *pair) for pair in pairs])
    assert held.mean(edges) == pytest.approx(mean, abs=1e-6)
    square = np.array([finely(lambda t: at(t) * np.abs(at(t)), *pair) for pair in pairs])
    assert held.excess(edges) == pytest.approx(square - mean * np.abs(mean), abs=1e-5)


def test_a_command_before_its_first_row_is_none():
    held = Held(command([2.0, 4.0], [5.0, -5.0]), 6.0)
    assert held.mean(np.array([0.0, 1.0, 3.0])).tolist() == [0.0, 2.5]


def test_a_command_that_is_no_number_is_unknown_until_the_next_that_is_one():
    held = Held(command([0, 1, 2, 3, 4], [1.0, np.nan, np.nan, 7.0, 2.0]), 5.0)
    assert held.unknown.tolist() == [[1.0, 3.0]]
    assert held.mean(np.array([0.0, 1.0, 3.0, 4.0])).tolist() == [1.0, 7.0, 7.0]


def test_samples_of_one_time_become_their_mean():
    time, value = distinct(np.array([0.0, 1.0, 1.0, 2.0]), np.array([1.0, 2.0, 4.0, 5.0]))
    assert (time.tolist(), value.tolist()) == ([0.0, 1.0, 2.0], [1.0, 3.0, 5.0])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([5.0, 20.0, 83.0]), st.sampled_from([60, 400, 6000]))
def test_edges_ascend_hold_all_samples_and_are_not_too_many(seed, rate, most):
    """Whatever the plan: none twice, none outside, and at most about as many as asked for."""
    time = np.arange(0.0, 40.0, 1 / rate) + 0.2 / rate * rng(seed).uniform(-1, 1, int(40 * rate))
    starts = np.sort(rng(seed).uniform(0, 38, 15))
    held = Held(command(starts, rng(seed + 1).uniform(-10, 10, 15)), 40.0)
    edges = edges_of(time, held, most)
    assert np.all(np.diff(edges) > 0)
    assert edges[0] <= time[0]
    assert edges[-1] >= time[-1]
    assert edges.size <= 3 * most + 200


def test_a_slow_sine_without_steps_has_even_intervals():
    time = np.arange(0.0, 60.0, 0.02)
    start = np.arange(0.0, 60.0, 0.5)
    edges = edges_of(time, Held(command(start, 5 * np.sin(start / 5)), 60.0), 6000)
    assert np.max(np.diff(edges)) < 0.3


def test_where_most_samples_are_on_ramps_the_ticks_cut_their_intervals_and_no_sample_has_a_window():
    """Ticks of 40 ms and 3 % of the largest command, 80 samples/s: an interval for each sample, and one for each tick
    beside; two windows for each and seven intervals for each tick were three times as many."""
    start = np.arange(0.0, 120.0, 0.04)
    value = 30.0 * np.sin(start / 1.5)
    time = np.arange(0.011, 120.0, 1 / 80)
    edges = edges_of(time, Held(command(start, value), 120.0), 10_000)
    assert set(start[(start > edges[0]) & (start < edges[-1])].tolist()) <= set(edges.tolist())
    assert edges.size < time.size + start.size + 100


def test_a_gap_in_the_samples_is_an_interval_of_its_own():
    time = np.concatenate([np.arange(0.0, 20.0, 0.05), np.arange(30.0, 50.0, 0.05)])
    edges = edges_of(time, Held(command([0.0, 25.0, 40.0], [4.0, 8.0, 2.0]), 50.0), 6000)
    inside = edges[(edges > 20.1) & (edges < 29.9)]
    assert 25.0 in inside
    assert np.all((inside > 24.9) & (inside < 25.5)), "only the step of the command"
    assert np.min(np.abs(edges - 19.975)) < 0.03
    assert np.min(np.abs(edges - 29.975)) < 0.03


def test_samples_of_steady_stretches_only_have_edges():
    """A log that is written only while the thrust stands still, a second after each step."""
    time = np.concatenate([np.arange(k + 1.0, k + 3.0, 0.05) for k in range(0, 30, 3)])
    start = np.arange(0.0, 30.0, 3.0)
    edges = edges_of(time, Held(command(start, 1.0 + np.arange(10.0)), 30.0), 6000)
    assert set(start[1:].tolist()) <= set(edges.tolist())


def test_a_start_of_a_ramp_shares_no_interval_with_the_rest_before_it():
    """Between two samples: the edge lies before the first sample on the way."""
    start = np.concatenate([[0.0], 10.003 + 0.02 * np.arange(200)])
    value = np.concatenate([[0.0], 0.02 * np.arange(1, 201)])
    held = Held(command(start, value), 20.0)
    assert held.starts(0.5)[-1] == pytest.approx(10.003)
    time = np.arange(0.0, 14.0, 0.1)
    edges = edges_of(time, held, 6000)
    assert np.any((edges > 9.9) & (edges <= 10.003)), "what was held and what moves are apart"
