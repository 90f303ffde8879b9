"""Samples by the tick before them, tick by tick and in blocks, are as one by one."""

import numpy as np
import pytest

from identification.run_history import history as module
from identification.run_history.history import samples_in


def jittered(seed=0):
    """Samples, some before the first tick; intervals, some with none; ticks, some of which share a sample."""
    rng = np.random.default_rng(seed)
    time = np.sort(rng.uniform(0.0, 10.0, 700))
    time = time[(time < 4.0) | (time > 4.6)]
    edges = np.union1d(np.linspace(0.0, 10.0, 60), [4.1, 4.2, 9.99])
    when = np.sort(np.concatenate([rng.uniform(0.5, 9.0, 80), [0.5001, 0.5002, 4.3, 9.995]]))
    return samples_in(time, edges), when, rng.normal(size=when.size)


def one_by_one(samples, when, delay):
    """(N,) tick and s since then of each sample."""
    late = samples.time - delay
    last = np.array([max(int(np.sum(when <= t)) - 1, 0) for t in late])
    return last, np.maximum(late - when[last], 0.0)


@pytest.mark.parametrize("delay", [0.0, 0.013, -0.02, 0.7])
def test_the_tick_before_each_sample(delay):
    samples, when, _ = jittered()
    last, since = samples.after(when, delay)
    expected = one_by_one(samples, when, delay)
    assert np.array_equal(last, expected[0])
    assert since == pytest.approx(expected[1], abs=1e-12)


@pytest.mark.parametrize("delay", [0.0, 0.013, -0.02, 0.7])
def test_means_of_what_is_held(delay):
    samples, when, value = jittered()
    last, _ = one_by_one(samples, when, delay)
    assert samples.held_means(when, delay, value) == pytest.approx(samples.means(value[last]), abs=1e-12)


@pytest.mark.parametrize("block", [1, 7, 50, 10_000])
def test_means_of_what_comes_soon_after_a_tick(block, monkeypatch):
    monkeypatch.setattr(module, "SAMPLE_BLOCK", block)
    samples, when, value = jittered()
    within = np.where(np.arange(when.size) % 3 == 0, 1e9, 0.05)
    last, since = one_by_one(samples, when, 0.01)
    soon = since < within[last]
    assert 0.2 < np.mean(soon) < 0.8
    decays = np.where(soon, value[last] * np.exp(-3 * since), 0.0)
    expected = np.array([samples.means(decays), samples.means(np.where(soon, since, 0.0))])

    def told(last, since):
        return np.array([value[last] * np.exp(-3 * since), since])

    assert samples.means_after(when, 0.01, within, told, 2) == pytest.approx(expected, abs=1e-12)
    which = np.concatenate([each[0] for each in samples.soon_after(when, 0.01, within)])
    assert np.array_equal(which, np.flatnonzero(soon))


def test_none_comes_within_no_time():
    samples, when, _ = jittered()
    found = samples.means_after(when[when > 0], 0.0, np.zeros(when.size), lambda last, _since: np.ones((1, last.size)))
    first = samples.time < when[0]
    assert found == pytest.approx(samples.means(np.where(first, 1.0, 0.0))[np.newaxis])
