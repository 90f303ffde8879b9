"""A hold at constant voltage, of fixed length or until steady, and the point it gives. Pure: time is given."""

from __future__ import annotations

from dataclasses import replace
from math import isnan

from rig.campaign.plan import Step
from rig.link.front_end_messages import Point
from rig.sequence.steady import Window
from rig.sequence.ticks import EPSILON, Settings

LOOK_PERIOD = 0.2
"""s between two looks whether it is steady: a look costs some milliseconds."""
LOOKS = 2
"""Looks in a row that must find it steady: one alone would sooner or later be lucky."""


class Holding:
    """One hold from `start` s on. Its first `step.settle` s are left out of the mean."""

    def __init__(self, start: float, step: Step, settings: Settings) -> None:
        self._start, self._step, self._settings = start, step, settings
        self._longest = step.max_duration
        self._next_look = step.min_duration - (LOOKS - 1) * LOOK_PERIOD
        self._steady_looks = 0
        self._window = Window(start + step.settle, settings.estimator)

    def advance(self, time: float, rows: tuple[tuple[float, float], ...]) -> bool:
        """True when the hold is over. `rows`: (s, N) thrust samples since the last call, raw."""
        self._window.add(rows)
        elapsed = time - self._start + EPSILON
        if self._settings.max_std_error is None or elapsed < self._next_look:
            return elapsed >= self._step.max_duration
        self._next_look = elapsed + LOOK_PERIOD
        self._steady_looks = self._steady_looks + 1 if self._steady() else 0
        return elapsed >= self._step.max_duration or (
            self._steady_looks >= LOOKS and elapsed >= self._step.min_duration
        )

    def extend(self) -> float:
        """Let it last longer, by as long as it was to last at most; returns that, s."""
        longer = self._longest
        self._step = replace(self._step, max_duration=self._step.max_duration + longer)
        return longer

    def point(self, time: float, tare: float) -> Point | None:
        """The point of a hold that ends at `time` s, less `tare` N; None with too few samples for an error."""
        estimate = self._window.estimate
        if isnan(estimate.std_error):
            return None
        return Point(
            step=self._step.index,
            voltage=self._step.voltage,
            thrust=estimate.mean - tare,
            std_error=estimate.std_error,
            dof=estimate.dof,
            duration=time - self._start,
            steady=self._steady(),
            thruster=self._settings.thruster,
        )

    def _steady(self) -> bool:
        """Always True for a fixed dwell, which has no thresholds."""
        error, drift = self._settings.max_std_error, self._settings.max_drift
        return error is None or drift is None or self._window.steady(error, drift)

    def __str__(self) -> str:
        return f"step {self._step.number} at {self._step.voltage:g} V: {self._window}"
