"""Samples averaged over intervals: means, numbers and times against scipy's, and intervals that a jump tore."""

import numpy as np
import pytest
from scipy.stats import binned_statistic

from identification.mismatch.prepare.binned import binned, untorn

EDGES = np.array([0.0, 0.5, 0.6, 2.0, 2.5, 4.0])


def samples(seed=0):
    rng = np.random.default_rng(seed)
    time = np.sort(np.concatenate([rng.uniform(0.0, 2.0, 40), rng.uniform(2.5, 4.0, 30)]))
    return time, rng.normal(3.0, 2.0, time.size)


def test_means_numbers_and_times_are_those_of_the_samples_in_each_interval():
    time, value = samples()
    mean, count, sampled = binned(time, value, EDGES)
    known = [
        binned_statistic(time, of, kind, EDGES).statistic
        for of, kind in ((value, "mean"), (value, "count"), (time, "mean"))
    ]
    some = count > 0
    assert some.tolist() == [True, True, True, False, True]
    assert mean[some] == pytest.approx(known[0][some])
    assert count.tolist() == known[1].tolist()
    assert sampled[some] == pytest.approx(known[2][some])


def test_an_interval_without_samples_has_no_mean_and_its_middle_for_a_time():
    mean, count, sampled = binned(*samples(), EDGES)
    assert np.isnan(mean[3])
    assert (count[3], sampled[3]) == (0, 2.25)


def test_a_sample_on_an_edge_is_in_the_interval_that_begins_there_and_none_is_beyond_the_ends():
    time = np.array([-0.1, 0.0, 0.5, 0.6, 4.0, 4.1])
    mean, count, _ = binned(time, np.arange(6.0), EDGES)
    assert count.tolist() == [1, 1, 1, 0, 0]
    assert mean[:3].tolist() == [1.0, 2.0, 3.0]


def test_the_sum_of_all_is_kept():
    time, value = samples(3)
    mean, count, sampled = binned(time, value, EDGES)
    assert np.nansum(mean * count) == pytest.approx(value.sum())
    assert np.sum(sampled * count) == pytest.approx(time.sum())


def test_an_interval_of_which_a_jump_left_less_than_half_is_taken_for_none():
    mean, sampled = np.array([1.0, 2.0, 3.0]), np.array([0.2, 0.55, 1.0])
    whole = np.array([10, 10, 10])
    left = untorn((mean, np.array([4, 5, 10]), sampled), whole)
    assert np.isnan(left[0]).tolist() == [True, False, False]
    assert left[1].tolist() == [0, 5, 10]
    assert left[2].tolist() == sampled.tolist()
