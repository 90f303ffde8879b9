"""What a driver that ticks does at the samples, beside the straight lines through its means over intervals."""

from __future__ import annotations

import numpy as np

from identification.recording import Floats
from identification.run_history.filters import reconstructed, within_intervals
from identification.run_history.history import LARGEST_LEAD, History, Samples


def lead(history: History, seen: Floats, means: Floats, samples: Samples, size: float) -> Floats:
    """(M,) what is `seen` at the samples, mean over an interval, beside the line through `means` (M,).

    Nothing where that is too much for a tick, `size` what the largest driver makes of it.
    """
    beside = seen - reconstructed(means, history.middle, samples.middle)
    return _ticks(np.where(samples.count > 0, beside, 0.0), size)


def curvature(history: History, seen: Floats, means: Floats, force: Floats, beside: Floats, samples: Samples) -> Floats:
    """(M,) rate |rate| `seen` at the samples less the line through its means `force` (M,), and what the lead `beside`
    the `means` of the rate makes of it."""
    line = reconstructed(force, history.middle, samples.middle)
    return np.where(beside != 0, seen - line - 2 * np.abs(means) * beside, 0.0)


def each_lead(history: History, value: Floats, means: Floats, size: float) -> Floats:
    """(N,) as `lead`, of each thrust sample."""
    return _ticks(value - within_intervals(means, history.edges, history.sample_time), size)


def with_leads(history: History, measured: Floats | None = None) -> History:
    """With what its driver itself does at the samples: a command by its ticks, or `measured` (N,) at each sample.

    What is measured is paired with the thrust of the same instant, however quickly it moves.
    """
    if history.ticks is None:
        return history if measured is None else _paired(history, measured)
    driver, size, samples = history.driver, history.size, history.thrust_samples
    value = _held(history, samples)
    beside = lead(history, samples.means(value), driver, samples, size)
    force = driver * np.abs(driver)
    curved = curvature(history, samples.means(value * np.abs(value)), driver, force, beside, samples)
    out = history.with_driver(lead=beside, curved=curved, sample_lead=each_lead(history, value, driver, size))
    if history.rate is None:
        return out
    turning = history.rate_samples
    return out.with_driver(rate_lead=lead(history, turning.means(_held(history, turning)), driver, turning, size))


def _paired(history: History, value: Floats) -> History:
    driver, samples = history.driver, history.thrust_samples
    beside = lead(history, samples.means(value), driver, samples, np.inf)
    line = reconstructed(driver * np.abs(driver), history.middle, samples.middle)
    curved = samples.means(value * np.abs(value)) - line - 2 * np.abs(driver) * beside
    return history.with_driver(
        lead=beside,
        curved=np.where(samples.count > 0, curved, 0.0),
        sample_lead=each_lead(history, value, driver, np.inf),
    )


def _held(history: History, samples: Samples) -> Floats:
    """(N,) the command at each sample."""
    assert history.ticks is not None
    when, value = history.ticks
    last, _ = samples.after(when, 0.0)
    out: Floats = value[last]
    return out


def _ticks(value: Floats, size: float) -> Floats:
    out: Floats = np.where(np.abs(value) < LARGEST_LEAD * size, value, 0.0)
    return out
