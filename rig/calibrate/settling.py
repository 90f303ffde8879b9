"""When a reading has settled under a load, and what it then is. Pure: samples and times are given."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import isfinite, sqrt
from statistics import fmean, pvariance

LEAST_ROWS = 8
"""Readings in the time that is looked at, without which nothing is said of it."""
NOISE = 3.0
"""Standard errors by which two halves may differ that are the same."""


@dataclass
class Settling:
    """Of one load. `add` takes each reading with its time (s); `settled` judges the last `look` seconds of them."""

    hung: float
    """s, when the load was put on."""
    look: float
    """s"""
    steady: float
    """N that the second half of these may be from the first."""
    rows: deque[tuple[float, float]] = field(default_factory=deque)

    def add(self, time: float, value: float) -> None:
        if time < self.hung or not isfinite(value):
            return
        self.rows.append((time, value))
        while self.rows[0][0] < time - self.look:
            self.rows.popleft()

    def settled(self, now: float) -> bool:
        """The load has hung for `look` s at least, and its reading stands still as far as noise lets one see."""
        if now - self.hung < self.look or len(self.rows) < LEAST_ROWS:
            return False
        middle = now - 0.5 * self.look
        first = [value for time, value in self.rows if time < middle]
        second = [value for time, value in self.rows if time >= middle]
        if min(len(first), len(second)) < LEAST_ROWS // 2:
            return False
        error = sqrt(pvariance(first) / len(first) + pvariance(second) / len(second))
        return abs(fmean(second) - fmean(first)) <= max(self.steady, NOISE * error)

    @property
    def mean(self) -> float:
        """N, of what is looked at; NaN before the first reading."""
        return fmean(value for _, value in self.rows) if self.rows else float("nan")
