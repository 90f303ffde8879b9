"""Samples averaged over the intervals of a run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

Binned = tuple[Floats, NDArray[np.int64], Floats]
"""Mean value, number of samples and mean time of each interval."""


def binned(time: Floats, value: Floats, edges: Floats) -> Binned:
    """Mean value (NaN where none), number of samples and mean time in each interval."""
    M = edges.size - 1
    index = np.searchsorted(edges, time, side="right") - 1
    inside = (index >= 0) & (index < M)
    index = index[inside]
    count = np.bincount(index, minlength=M)
    some = np.maximum(count, 1)
    mean = np.where(count > 0, np.bincount(index, weights=value[inside], minlength=M) / some, np.nan)
    when = np.bincount(index, weights=time[inside], minlength=M) / some
    middle = 0.5 * (edges[1:] + edges[:-1])
    return mean, count, np.where(count > 0, when, middle)


def untorn(found: Binned, whole: NDArray[np.int64]) -> Binned:
    """Means, counts and times without the intervals of which a jump left less than a half: no end stands for all."""
    mean, count, sampled = found
    torn = count < 0.5 * whole
    mean[torn], count[torn] = np.nan, 0
    return mean, count, sampled
