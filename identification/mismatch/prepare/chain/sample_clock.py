"""When a device took its samples, from when they arrived: its own even clock, and what came between is lateness."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.recording import Floats

WINDOW = 5.0
"""s over which the rate of the clock is looked at: a lost row in it changes little, and most windows have none."""
TAIL = 50
"""Rows at the end of which none can be told to be lost: what is late there may only be late."""


def sample_times(arrival: Floats, period: float) -> Floats | None:
    """(n,) s at which an even clock of about `period` s ticked, each at or before its arrival (n,) s.

    A row that is late is followed by rows that are not; one that was lost makes all that follow late by whole periods.
    The clock is the line below all arrivals that is nearest to them: the quickest rows are in time. Between pauses of
    the stream the clock may begin anew. None where the arrivals are not those of such a clock.
    """
    pauses = np.flatnonzero(np.diff(arrival) > policy.prepare.CLOCK_PAUSE * period) + 1
    parts = np.split(arrival, pauses)
    found: list[Floats | None] = [
        _of_one_clock(part, period) if part.size >= policy.prepare.CLOCK_ROWS else part for part in parts
    ]
    if any(part is None for part in found) or max(part.size for part in parts) < policy.prepare.CLOCK_ROWS:
        return None
    out: Floats = np.maximum.accumulate(np.concatenate([part for part in found if part is not None]))
    return out


def _of_one_clock(arrival: Floats, period: float) -> Floats | None:
    rows = np.arange(arrival.size)
    each = max(round(WINDOW / period), TAIL)
    starts = range(0, max(arrival.size - each, 1), each)
    tick = float(np.median([_line_below(rows[i : i + each], arrival[i : i + each])[1] for i in starts]))
    if abs(tick / period - 1) > policy.prepare.CLOCK_RATE_ERROR:
        return None
    index = rows + _lost(arrival - tick * rows, tick)
    begin, tick = _line_below(index, arrival)
    clock = np.asarray(begin + tick * index, dtype=np.float64)
    usual = float(np.quantile(arrival - clock, policy.prepare.CLOCK_LATE_SHARE))
    return clock if usual < policy.prepare.CLOCK_LATEST * tick else None


def _lost(late: Floats, tick: float) -> NDArray[np.intp]:
    """(n,) rows lost before each: whole periods by which all that follow are late (n,) s too."""
    least = late.copy()
    least[-TAIL:] = np.min(late[-TAIL:])
    least = np.minimum.accumulate(least[::-1])[::-1]
    out: NDArray[np.intp] = np.round((least - least[0]) / tick).astype(np.intp)
    return out


def _line_below(x: NDArray[np.intp], y: Floats) -> tuple[float, float]:
    """(value at 0, slope) of the line that has no point below it and the least distance to all together: the edge of
    the lower convex hull (Andrew, Inf. Process. Lett. 9, 1979, 216) over the mean of x."""
    hull: list[tuple[float, float]] = []
    for point in zip(x.tolist(), y.tolist(), strict=True):
        while len(hull) > 1 and _turns_down(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    middle = float(np.mean(x))
    at = next(i for i in range(1, len(hull)) if hull[i][0] >= middle)
    (left, low), (right, high) = hull[at - 1], hull[at]
    slope = (high - low) / (right - left)
    return low - slope * left, slope


def _turns_down(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> bool:
    return (b[1] - a[1]) * (c[0] - b[0]) >= (c[1] - b[1]) * (b[0] - a[0])
