"""A tare: thrust at rest over a fixed time, taken only when it is stable, tried a few times. Pure: time is given."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

from rig.campaign.plan import TareConfig
from rig.sequence.steady import SteadyEstimator, Window
from rig.sequence.ticks import EPSILON


class TareStep(NamedTuple):
    """`again`: this attempt was not stable and the next has begun; `failed`: it was the last one."""

    verdict: Literal["waiting", "accepted", "again", "failed"]
    mean: float = 0.0
    """N, of an accepted tare."""
    text: str = ""


class Taring:
    """The attempts of one tare of `duration` s each, from `start` s on."""

    def __init__(
        self, start: float, duration: float, wanted: TareConfig, estimator: Callable[[], SteadyEstimator]
    ) -> None:
        self._start, self._duration, self._wanted, self._estimator = start, duration, wanted, estimator
        self._window = Window(start, estimator)
        self._attempt = 1

    def advance(self, time: float, rows: tuple[tuple[float, float], ...]) -> TareStep:
        """`rows`: (s, N) thrust samples since the last call, raw."""
        self._window.add(rows)
        if time - self._start < self._duration - EPSILON:
            return TareStep("waiting")
        window, wanted = self._window, self._wanted
        if window.steady(wanted.max_std_error, wanted.max_drift):
            return TareStep("accepted", window.estimate.mean, f"tare {window}")
        text = (
            f"tare attempt {self._attempt} of {wanted.attempts} is not stable: {window}; "
            f"{wanted.max_std_error:g} N and {wanted.max_drift:g} N/s are allowed"
        )
        if self._attempt == wanted.attempts:
            return TareStep("failed", text=text)
        self._attempt += 1
        self._start, self._window = time, Window(time, self._estimator)
        return TareStep("again", text=text)
