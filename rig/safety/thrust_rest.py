"""The force sensor as a second witness of rest: a propeller that turns pushes. Pure: rows are given."""

from __future__ import annotations

from collections import deque
from math import isfinite
from statistics import fmean, pstdev

WINDOW = 0.2
"""s of rows that the mean is taken of, and at least `LEAST_ROWS` of a slow sensor."""
LEAST_ROWS = 4
OLDEST = 1.0
"""s, age of a row that still witnesses."""
SHARE = 0.05
"""Of the largest thrust since the tare: back within that, the propeller turns at less than a quarter of its fastest
(thrust goes with n|n|, and 0.22^2 = 0.05). Creep and hysteresis of a load cell are below."""
SIGMAS = 6.0
"""Of the rows at the tare."""


class ThrustRest:
    """Of one thruster on the bench. Without a tare it knows nothing."""

    def __init__(self, limit: float | None = None) -> None:
        """`limit`: N from the tare that count as none; None: what the noise and the largest thrust allow."""
        self._limit = limit
        self._rows: deque[tuple[float, float]] = deque()
        self._tare: float | None = None
        self._told: float | None = None
        self._noise = self._largest = self._mean = 0.0

    def add(self, rows: tuple[tuple[float, float], ...]) -> None:
        """(s, N), raw; the newest say how large the thrust is."""
        self._rows.extend(row for row in rows if isfinite(row[1]))
        while len(self._rows) > LEAST_ROWS and self._rows[0][0] < self._rows[-1][0] - WINDOW:
            self._rows.popleft()
        if self._rows:
            self._mean = fmean([value for _, value in self._rows])
        if self._tare is not None and len(self._rows) >= LEAST_ROWS:
            self._largest = max(self._largest, abs(self._mean - self._tare))

    def tared(self, mean: float) -> None:
        """A tare was accepted, in N; the rows at hand are of it."""
        if mean == self._told:
            return
        self._told = self._tare = mean
        self._noise = pstdev(value for _, value in self._rows) if self._rows else 0.0

    def doubt(self) -> None:
        """A later tare was not stable: the zero may have moved, and witnesses nothing until one is accepted."""
        self._tare = None

    @property
    def within(self) -> float:
        """N from the tare that count as none."""
        if self._limit is not None:
            return self._limit
        return SHARE * self._largest + SIGMAS * self._noise

    def push(self, now: float) -> float | None:
        """N from the tare, mean of the newest rows; None without a tare or fresh rows."""
        fresh = [row for row in self._rows if row[0] >= now - OLDEST]
        return None if self._tare is None or len(fresh) < LEAST_ROWS else self._mean - self._tare

    def judge(self, now: float) -> bool | None:
        """True: back at its tare; False: something pushes; None: no witness (no tare, no fresh rows, or a value that
        stands still elsewhere, as a stuck sensor does)."""
        fresh = [row for row in self._rows if row[0] >= now - OLDEST]
        if self._tare is None or len(fresh) < LEAST_ROWS:
            return None
        if abs(self._mean - self._tare) <= self.within:
            return True
        return False if any(value != fresh[0][1] for _, value in fresh) else None
