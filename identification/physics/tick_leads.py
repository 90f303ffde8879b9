"""What a driver that ticks does at the samples, beside the straight lines through its means over intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.physics.filters import reconstructed, within_intervals
from identification.physics.history import LARGEST_LEAD, History, Samples
from identification.physics.ticks_passed import Passed
from identification.recording import Floats


def at_samples(history: History, passed: Passed, samples: Samples) -> Floats:
    """(N,) rate at each sample, as dynamics pass it on; rate |rate| as a stand that rings shows it."""
    assert history.ticks is not None
    when, value = history.ticks
    answer = passed.at if passed.ring is None else passed.rung_at
    return answer(*samples.after(when, passed.delay), when, value)


def lead(history: History, passed: Passed, value: Floats, means: Floats, samples: Samples) -> Floats:
    """(M,) what `value` (N,) of `at_samples` has, mean over an interval, beside the line through `means` (M,)."""
    beside = samples.means(value) - reconstructed(means, history.middle, samples.middle)
    return _ticks(np.where(samples.count > 0, beside, 0.0), history, passed)


def curvature(history: History, value: Floats, means: Floats, beside: Floats, samples: Samples) -> Floats:
    """(M,) rate |rate| at the samples less what the line through means of the rate and its lead `beside` make of it."""
    line = reconstructed(means * np.abs(means), history.middle, samples.middle)
    out: Floats = samples.means(value * np.abs(value)) - line - 2 * np.abs(means) * beside
    return np.where(beside != 0, out, 0.0)


def each_lead(history: History, passed: Passed, value: Floats, means: Floats, samples: Samples) -> Floats:
    """(N,) as `lead`, sample by sample."""
    return _ticks(value - within_intervals(means, history.edges, samples.time), history, passed)


def with_leads(history: History) -> History:
    """With what its command itself does at the samples; a measured driver has no ticks, but curves all the same."""
    if history.ticks is None:
        return replace(history, curved=history.excess)
    still, thrust, driver = Passed(), history.thrust_samples, history.driver
    value = at_samples(history, still, thrust)
    beside = lead(history, still, value, driver, thrust)
    out = replace(
        history,
        lead=beside,
        curved=curvature(history, value, driver, beside, thrust),
        sample_lead=each_lead(history, still, value, driver, thrust),
    )
    if history.rate is None:
        return out
    turning = history.rate_samples
    return replace(out, rate_lead=lead(history, still, at_samples(history, still, turning), driver, turning))


def _ticks(value: Floats, history: History, passed: Passed) -> Floats:
    """Without what is too much for a tick: of the driver, or what so much of it changes of driver |driver|."""
    size = history.size if passed.ring is None else 2 * history.size**2
    out: Floats = np.where(np.abs(value) < LARGEST_LEAD * size, value, 0.0)
    return out
