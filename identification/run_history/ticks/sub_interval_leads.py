"""What a driver that ticks does at the samples, beside the straight lines through its means over intervals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats
from identification.run_history.filters import reconstructed, within_intervals
from identification.run_history.history import LARGEST_LEAD, History, Samples


def lead(history: History, seen: Floats, means: Floats, samples: Samples, size: float) -> Floats:
    """(M,) what is `seen` at the samples, mean over an interval, beside the line through `means` (M,).

    Nothing where that is too much for a tick, `size` what the largest driver makes of it.
    """
    beside = seen - reconstructed(means, history.middle, samples.middle)
    return np.where(_of_ticks(beside, samples, size), beside, 0.0)


def lead_and_curvature(
    history: History, seen: tuple[Floats, Floats], means: tuple[Floats, Floats], samples: Samples, size: float
) -> Floats:
    """(2, M) of the rate `lead`, and rate |rate| at the samples less the line through its means and what the lead makes
    of it. `seen` and `means`: of rate and rate |rate|."""
    beside, force = (s - reconstructed(m, history.middle, samples.middle) for s, m in zip(seen, means, strict=True))
    curved = force - 2 * np.abs(means[0]) * beside
    return np.where(_of_ticks(beside, samples, size), np.array([beside, curved]), 0.0)


def _of_ticks(beside: Floats, samples: Samples, size: float) -> NDArray[np.bool_]:
    return (samples.count > 0) & (np.abs(beside) < LARGEST_LEAD * size)


def each_lead(history: History, value: Floats, means: Floats, size: float) -> Floats:
    """(N,) as `lead`, of each thrust sample."""
    beside = value - within_intervals(means, history.edges, history.sample_time)
    return np.where(np.abs(beside) < LARGEST_LEAD * size, beside, 0.0)


def with_leads(history: History, measured: Floats | None = None) -> History:
    """With what its driver itself does at the samples: a command by its ticks, or `measured` (N,) at each sample.

    What is measured is paired with the thrust of the same instant, however quickly it moves.
    """
    if history.ticks is None:
        return history if measured is None else _paired(history, measured)
    (when, value), driver, size, samples = history.ticks, history.driver, history.size, history.thrust_samples
    seen = samples.held_means(when, 0.0, value), samples.held_means(when, 0.0, value * np.abs(value))
    beside, curved = lead_and_curvature(history, seen, (driver, driver * np.abs(driver)), samples, size)
    if history.rate is None:
        return history.with_driver(lead=beside, curved=curved)
    turning = history.rate_samples
    rate_lead = lead(history, turning.held_means(when, 0.0, value), driver, turning, size)
    return history.with_driver(lead=beside, curved=curved, rate_lead=rate_lead)


def _paired(history: History, value: Floats) -> History:
    driver, samples = history.driver, history.thrust_samples
    seen = samples.means(value), samples.means(value * np.abs(value))
    beside, curved = lead_and_curvature(history, seen, (driver, driver * np.abs(driver)), samples, np.inf)
    return history.with_driver(
        lead=beside,
        curved=curved,
        sample_lead=each_lead(history, value, driver, np.inf),
    )
