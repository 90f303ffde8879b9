"""How far the rotor is from what the driver alone would make of it."""

from __future__ import annotations

import numpy as np

from identification.recording import Floats
from identification.run_history.filters import reconstructed
from identification.run_history.rate_gap import running, without_ticks
from identification.run_history.remembered import RememberedRun


def slip(run: RememberedRun, x: Floats, k: float) -> Floats:
    """(M,) measured rate / k minus x, without the noise of the rate."""
    history = run.history
    rows = history.rate_rows
    if history.rate is None or history.rate_sampled is None or rows.size < 2:
        return np.zeros_like(x)
    there = reconstructed(x, history.middle, history.rate_sampled)[rows]
    gap = without_ticks(history.rate[rows] / k - there, history)
    if run.rate_gap is not None:
        return run.rate_gap.calmed(gap, history)
    asked = run.rate_asked
    gap, there, time = gap[asked], there[asked], history.rate_sampled[rows][asked]
    amount, share = running(gap, np.ones_like(gap)), running(gap, there)
    by_share = share.error < amount.error
    found = share if by_share else amount
    out: Floats = np.interp(history.middle, time, found.coefficient)
    return x * out if by_share else out
