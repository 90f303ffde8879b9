"""The rhythm of a plan: what a model leaves after each of many equal holds comes again as a comb of lines.

Of steps every T s the residual repeats with them: its spectrum has lines at k / T that no disturbance makes. One
line there may be a true one; where there are several none can be told from them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.mismatch import policy
from identification.run_history.history import History


def of_the_plan(history: History) -> tuple[tuple[float, float], ...]:
    """Hz, low and high: where the steps of this run come again; none where its holds are not of one duration."""
    begins = history.edges[:-1][np.diff(history.since_step, prepend=np.inf) < 0]
    holds = np.diff(begins)
    if holds.size < policy.periodic.EQUAL_HOLDS:
        return ()
    period = float(np.median(holds))
    equal = np.abs(holds - period) < policy.periodic.HOLD_DIFFERENCE * period
    if float(np.mean(equal)) < policy.periodic.EQUAL_HOLDS_SHARE:
        return ()
    width = 1.0 / float(history.edges[-1] - history.edges[0])
    return tuple((k / period - width, k / period + width) for k in range(1, policy.periodic.PLAN_HARMONICS + 1))


def within(frequency: float, bands: Sequence[tuple[float, float]]) -> bool:
    """Whether a frequency in Hz lies in one of these bands."""
    return any(low <= frequency <= high for low, high in bands)
