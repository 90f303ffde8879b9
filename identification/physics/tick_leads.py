"""What a driver that ticks does at the samples, beside the straight lines through its means over intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.physics.filters import reconstructed, within_intervals
from identification.physics.history import LARGEST_LEAD, History, Samples
from identification.physics.ticks_passed import Passed
from identification.recording import Floats


def at_samples(history: History, passed: Passed, samples: Samples) -> Floats:
    """(N,) driver at each sample, as dynamics pass it on."""
    assert history.ticks is not None
    when, value = history.ticks
    return passed.at(*samples.after(when, passed.delay), when, value)


def leads(history: History, value: Floats, means: Floats, samples: Samples) -> Floats:
    """(2, M): the driver `value` (N,) at samples less the line through its `means` (M,), and driver |driver| there less
    what line and lead make of it; both means over each interval."""
    lead = samples.means(value) - reconstructed(means, history.middle, samples.middle)
    line = reconstructed(means * np.abs(means), history.middle, samples.middle)
    curved = samples.means(value * np.abs(value)) - line - 2 * np.abs(means) * lead
    tick = (samples.count > 0) & (np.abs(lead) < LARGEST_LEAD * history.size)
    return np.where(tick, [lead, curved], 0.0)


def each_lead(history: History, value: Floats, means: Floats, samples: Samples) -> Floats:
    """(N,) the first of `leads`, sample by sample."""
    lead = value - within_intervals(means, history.edges, samples.time)
    out: Floats = np.where(np.abs(lead) < LARGEST_LEAD * history.size, lead, 0.0)
    return out


def with_leads(history: History) -> History:
    """With what its command itself does at the samples; a measured driver has no ticks, but curves all the same."""
    if history.ticks is None:
        return replace(history, curved=history.excess)
    still, thrust = Passed(), history.thrust_samples
    value = at_samples(history, still, thrust)
    lead, curved = leads(history, value, history.driver, thrust)
    own = each_lead(history, value, history.driver, thrust)
    out = replace(history, lead=lead, curved=curved, sample_lead=own)
    if history.rate is None:
        return out
    turning = history.rate_samples
    return replace(out, rate_lead=leads(history, at_samples(history, still, turning), history.driver, turning)[0])
