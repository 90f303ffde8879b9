"""An identified vehicle against its trials: simulated from the commands and how each trial began."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.maximum_likelihood import Gaussian
from identification.recording import Floats
from identification.vehicle.simulation import RUNAWAY, simulate_all
from identification.vehicle.trials import Trial


@dataclass(frozen=True, slots=True)
class Validation:
    """An identified vehicle against one trial."""

    recording_id: str
    quantity: str
    rmse: float
    """Unit of the measurement."""
    fit: float
    """%: 100 (1 - |y - y_hat| / |y - mean y|); 0 is as good as the mean of the measurements."""

    @property
    def statement(self) -> str:
        return f"{self.recording_id}: simulated {self.quantity} is off by {self.rmse:.3g} rms, fit {self.fit:.1f} %"


def fit_percent(measured: Floats, simulated: Floats) -> float:
    """Normalised root mean square fit, %.

    >>> fit_percent(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]))
    100.0
    """
    power = float(np.linalg.norm(measured - measured.mean()))
    return 100 * (1 - float(np.linalg.norm(measured - simulated)) / power) if power > 0 else float("nan")


@dataclass(frozen=True, eq=False)
class Replay:
    """One trial as measured and as the identified vehicle does it, (n,)."""

    recording_id: str
    quantity: str
    time: Floats
    measured: Floats
    simulated: Floats

    @property
    def ran_away(self) -> bool:
        """The identified vehicle gathers speed without end: its drag is negative where the trial takes it."""
        return bool(np.abs(self.simulated).max() >= RUNAWAY / 2)

    @property
    def validation(self) -> Validation:
        rmse = float(np.sqrt(np.mean((self.measured - self.simulated) ** 2)))
        return Validation(self.recording_id, self.quantity, rmse, fit_percent(self.measured, self.simulated))


STARTS = 5
"""Gauss and Newton's steps for the start of a trial: its position enters as it is, its velocity nearly so."""


def replay(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str] | None = None, *, fit_start: bool = True
) -> tuple[Replay, ...]:
    """Simulate each trial; the model sees the commands and how the trial began, nothing else.

    `fit_start`: position and velocity at the start are those that suit the whole trial best; else a speed trial
    starts from its first measurement and a position trial from the straight line through its first five, noise and
    all. `buoyancy`: recording id -> parameter.
    """
    starts = np.array([_start(one) for one in trials]).reshape(-1, 2)
    best = _responses(trials, estimate, buoyancy or {}, starts[None])
    for _ in range(STARTS if fit_start else 0):
        guess = _better_starts(trials, estimate, buoyancy or {}, starts, best)
        found = _responses(trials, estimate, buoyancy or {}, guess[None])
        for i, (one, now, new) in enumerate(zip(trials, best, found, strict=True)):
            if np.sum((one.response - new) ** 2) < np.sum((one.response - now) ** 2):
                starts[i], best[i] = guess[i], new
    return tuple(
        Replay(one.recording_id, one.quantity, one.time, one.response, y[0])
        for one, y in zip(trials, best, strict=True)
    )


def _better_starts(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str], starts: Floats, now: Sequence[Floats]
) -> Floats:
    """One step of Gauss and Newton from starts (t, 2), whose responses (1, n) each are `now`."""
    step = 0.01 * np.abs(starts[:, 1]) + 1e-3 * np.array([_rate(one) for one in trials])
    faster = _responses(trials, estimate, buoyancy, (starts + step[:, None] * [0.0, 1.0])[None])
    out = starts.copy()
    for i, one in enumerate(trials):
        slope = (faster[i] - now[i]).T / step[i]
        H = np.hstack([np.ones(slope.shape), slope]) if one.quantity == "position" else slope
        gain, *_ = np.linalg.lstsq(H, one.response - now[i][0], rcond=None)
        out[i, -gain.size :] += gain
    return out


def _rate(one: Trial) -> float:
    """Size of the velocities of a trial, above 0."""
    size = float(np.ptp(one.response))
    return max(size if one.quantity == "speed" else size / float(np.ptp(one.time)), 1e-6)


def _responses(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str], starts: Floats
) -> list[Floats]:
    """What would have been measured (k, n) in each of t trials, for k sets of starts (k, t, 2)."""
    states = [(f"x0[{i}]", f"v0[{i}]") for i in range(len(trials))]
    names = (*estimate.names, *(name for state in states for name in state))
    theta = np.hstack([np.tile(estimate.mean, (len(starts), 1)), starts.reshape(len(starts), -1)])
    floats = [buoyancy.get(one.recording_id, "") for one in trials]
    moved = simulate_all(trials, names, theta, floats, states)
    return [m.position if one.quantity == "position" else m.velocity for one, m in zip(trials, moved, strict=True)]


def validate(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str] | None = None, *, fit_start: bool = True
) -> tuple[Validation, ...]:
    """`replay` in numbers."""
    return tuple(found.validation for found in replay(trials, estimate, buoyancy, fit_start=fit_start))


def _start(one: Trial) -> Floats:
    """Position and velocity at the start of a trial as its first measurements have them."""
    if one.quantity == "speed":
        return np.array([0.0, one.response[0]])
    slope, level = np.polyfit(one.time[:5] - one.time[0], one.response[:5], 1)
    return np.array([level, slope])
