"""Spread from unit to unit, by differences of neighbours: neither a drift nor a few odd units widen it."""

from __future__ import annotations

import numpy as np

from identification.recording import Floats

MEDIAN_ABS = 0.6744897501960817
"""Median of |z| of a standard normal z."""
HALVINGS = 60


def unit_spread(value: Floats, std: Floats, group: Floats) -> float:
    """Standard deviation from unit to unit beyond that of the measurement, in the unit of `value`.

    `value` (n,) in order of production, `std` (n,) of each measurement's own scatter, `group` (n,) of whole numbers:
    which calibration it was measured by; only neighbours of one group are compared, for an error that they share
    cancels. The scale is that at which half of the differences, each over its standard deviation, are larger than the
    median of |z|: the moving range of two (Montgomery, Introduction to Statistical Quality Control, 6.4) with the
    median in place of the mean. 0 where the measurement's scatter explains all; NaN for fewer than two neighbours.
    """
    same = group[1:] == group[:-1]
    difference = np.abs(np.diff(value))[same]
    known = (std[1:] ** 2 + std[:-1] ** 2)[same]
    if difference.size == 0:
        return float("nan")

    def middle(sigma: float) -> float:
        total = np.sqrt(2.0 * sigma**2 + known)
        ratio = np.divide(difference, total, out=np.full_like(difference, np.inf), where=total > 0)
        ratio[(total == 0) & (difference == 0)] = 0.0
        return float(np.median(ratio))

    if middle(0.0) <= MEDIAN_ABS:
        return 0.0
    low, high = 0.0, float(difference.max())
    for _ in range(HALVINGS):
        half = 0.5 * (low + high)
        low, high = (half, high) if middle(half) > MEDIAN_ABS else (low, half)
    return high
