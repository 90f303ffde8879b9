"""Thrust during one hold or tare while it grows: mean, standard error, drift, and whether it is steady."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from identification.recording import Floats

LEAST_SAMPLES = 8
"""Fewer give no drift (identification.steady_state.steady)."""
AT_ONCE = 1000
"""Samples that are taken in together, in a quarter of a millisecond. All of a hold of 150 s at 1 kHz, at its end, took
40 ms, in which no command is sent and nothing is read."""


class SteadyEstimator(Protocol):
    """Mean of a growing series, with an error honest under autocorrelation. All NaN while unknown.

    `identification.steady_state.steady.SteadyMonitor` is the one that runs; asking it costs about a millisecond.
    """

    def add(self, time: Floats, value: Floats) -> None:
        """Samples (k,) in order: s, N. NaN are left out."""

    @property
    def mean(self) -> float: ...

    @property
    def std_error(self) -> float: ...

    @property
    def dof(self) -> float:
        """Degrees of freedom behind `std_error`."""

    @property
    def drift(self) -> float:
        """N/s."""


class Window:
    """The samples of one hold or tare from `start` s on; earlier ones are left out.

    Samples are kept until there are some, or somebody asks, so that a tick costs next to nothing.
    """

    def __init__(self, start: float, estimator: Callable[[], SteadyEstimator]) -> None:
        self._start = start
        self._estimate = estimator()
        self._new: list[tuple[float, float]] = []

    def add(self, rows: tuple[tuple[float, float], ...]) -> None:
        """(s, N) rows."""
        self._new.extend(rows)
        if len(self._new) >= AT_ONCE:
            self._take_in()

    @property
    def estimate(self) -> SteadyEstimator:
        """Of all samples so far."""
        if self._new:
            self._take_in()
        return self._estimate

    def _take_in(self) -> None:
        rows = np.array(self._new)
        kept = rows[rows[:, 0] >= self._start]
        self._estimate.add(kept[:, 0], kept[:, 1])
        self._new = []

    def steady(self, max_std_error: float, max_drift: float) -> bool:
        """Both known and small enough; N, N/s."""
        estimate = self.estimate
        return estimate.std_error <= max_std_error and abs(estimate.drift) <= max_drift

    def __str__(self) -> str:
        e = self.estimate
        return f"{e.mean:.4f} N, standard error {e.std_error:.4f} N, drift {e.drift:+.4f} N/s"
