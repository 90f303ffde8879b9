"""The force sensor as a second witness of rest: a propeller that turns pushes. Pure: rows are given."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import fsum, isfinite
from statistics import pstdev

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
        self._times: deque[float] = deque()
        self._values: deque[float] = deque()
        """N, of the same rows: their mean is taken in every tick, of hundreds of a fast sensor."""
        self._tare: float | None = None
        self._told: float | None = None
        self._noise = self._largest = self._mean = 0.0

    def add(self, rows: tuple[tuple[float, float], ...]) -> None:
        """(s, N), raw; the newest say how large the thrust is."""
        for time, value in rows:
            if isfinite(value):
                self._times.append(time)
                self._values.append(value)
        while len(self._times) > LEAST_ROWS and self._times[0] < self._times[-1] - WINDOW:
            self._times.popleft()
            self._values.popleft()
        if self._values:
            self._mean = fsum(self._values) / len(self._values)
        if self._tare is not None and len(self._values) >= LEAST_ROWS:
            self._largest = max(self._largest, abs(self._mean - self._tare))

    def tared(self, mean: float) -> None:
        """A tare was accepted, in N; the rows at hand are of it."""
        if mean == self._told:
            return
        self._told = self._tare = mean
        self._noise = pstdev(self._values) if self._values else 0.0

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
        return None if self._tare is None or len(self._fresh(now)) < LEAST_ROWS else self._mean - self._tare

    def judge(self, now: float) -> bool | None:
        """True: back at its tare; False: something pushes; None: no witness (no tare, no fresh rows, or a value that
        stands still elsewhere, as a stuck sensor does)."""
        fresh = self._fresh(now)
        if self._tare is None or len(fresh) < LEAST_ROWS:
            return None
        if abs(self._mean - self._tare) <= self.within:
            return True
        return False if any(value != fresh[0] for value in fresh) else None

    def _fresh(self, now: float) -> Sequence[float]:
        """N, of the rows that still witness."""
        if self._times and self._times[0] >= now - OLDEST:
            return self._values
        return [value for time, value in zip(self._times, self._values, strict=True) if time >= now - OLDEST]
