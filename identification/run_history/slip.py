"""How far the rotor is from what the driver alone would make of it."""

from __future__ import annotations

import numpy as np

from identification.recording import Floats
from identification.run_history.filters import reconstructed
from identification.run_history.rate_gap import Running, held_rows, running, without_ticks
from identification.run_history.remembered import RememberedRun

CALMER = 0.2
"""Of the error with which neighbours foretell a row of the gap: held rows that err less are the ones to be asked."""


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
    time = history.rate_sampled[rows]
    found, by_share = _foretold(gap, there)
    held = held_rows(there, gap)
    if not held.all():
        calm, calm_by_share = _foretold(gap[held], there[held])
        if calm.error < CALMER * found.error:  # the rest was when a reading was taken while the command moved
            found, by_share, time = calm, calm_by_share, time[held]
    out: Floats = np.interp(history.middle, time, found.coefficient)
    return x * out if by_share else out


def _foretold(gap: Floats, there: Floats) -> tuple[Running, bool]:
    """By an amount, or by a share of x (True), whichever errs less."""
    amount, share = running(gap, np.ones_like(gap)), running(gap, there)
    return (share, True) if share.error < amount.error else (amount, False)
