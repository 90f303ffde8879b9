"""Thrust during one hold or tare, judged while it grows: mean, standard error, drift, and whether it is steady."""

from __future__ import annotations

from collections.abc import Callable
from math import isnan, nan, sqrt
from typing import Protocol

BATCHES = 32
"""Most batches kept; then neighbours are merged, so that a batch grows longer than the correlation of the noise."""
LEAST_BATCHES = 8
"""Fewer batches say nothing about the error of their mean."""


class SteadyEstimator(Protocol):
    """Mean of a growing series, with an error honest under autocorrelation. All NaN while unknown."""

    def add(self, t: float, value: float) -> None:
        """One sample: s, N."""

    @property
    def mean(self) -> float: ...

    @property
    def std_error(self) -> float: ...

    @property
    def drift(self) -> float:
        """N/s."""


class Online:
    """Constant memory: batch means for the error (Law, Simulation Modeling and Analysis, 9.5.3), a line for drift."""

    def __init__(self) -> None:
        self._size = 1
        self._batches: list[float] = []
        self._pending: list[float] = []
        self._count = 0
        self._origin = 0.0
        self._mean_t = self._mean_y = self._tt = self._ty = 0.0

    def add(self, t: float, value: float) -> None:
        """One sample: s, N."""
        if self._count == 0:
            self._origin = t
        self._count += 1
        self._regress(t - self._origin, value)
        self._pending.append(value)
        if len(self._pending) == self._size:
            self._batches.append(sum(self._pending) / self._size)
            self._pending = []
        if len(self._batches) == BATCHES:
            self._batches = [(a + b) / 2 for a, b in zip(self._batches[::2], self._batches[1::2], strict=True)]
            self._size *= 2

    def _regress(self, t: float, value: float) -> None:
        """Welford's update of the means and of the sums for the slope."""
        dt = t - self._mean_t
        self._mean_t += dt / self._count
        self._mean_y += (value - self._mean_y) / self._count
        self._tt += dt * (t - self._mean_t)
        self._ty += dt * (value - self._mean_y)

    @property
    def mean(self) -> float:
        return self._mean_y if self._count else nan

    @property
    def std_error(self) -> float:
        """N, standard deviation of the batch means over the root of their number."""
        n = len(self._batches)
        if n < LEAST_BATCHES:
            return nan
        mean = sum(self._batches) / n
        return sqrt(sum((b - mean) ** 2 for b in self._batches) / (n - 1) / n)

    @property
    def drift(self) -> float:
        return self._ty / self._tt if self._tt > 0 else nan


class Window:
    """The samples of one hold or tare from `start` s on; earlier ones and NaN are left out."""

    def __init__(self, start: float, estimator: Callable[[], SteadyEstimator]) -> None:
        self._start = start
        self._estimate = estimator()

    def add(self, rows: tuple[tuple[float, float], ...]) -> None:
        """(s, N) rows."""
        for t, value in rows:
            if t >= self._start and not isnan(value):
                self._estimate.add(t, value)

    @property
    def mean(self) -> float:
        return self._estimate.mean

    @property
    def std_error(self) -> float:
        return self._estimate.std_error

    @property
    def drift(self) -> float:
        return self._estimate.drift

    def steady(self, max_std_error: float, max_drift: float) -> bool:
        """Both known and small enough; N, N/s."""
        return self._estimate.std_error <= max_std_error and abs(self._estimate.drift) <= max_drift

    def __str__(self) -> str:
        return f"{self.mean:.4f} N, standard error {self.std_error:.4f} N, drift {self.drift:+.4f} N/s"
