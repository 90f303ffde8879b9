"""Least squares of a calibration's steps: terms with the covariance of their scatter, and what a force's error does.

Two kinds of rows: the mean of each step, which scatters as a load that is put on again does, and the change within a
step, which only the noise of the readings disturbs and which tells the creep. The variance of each kind comes from its
own residuals (feasible generalised least squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.calibration.model import CREEP, Design, crept_beyond, design_of, terms_of, with_creep
from identification.calibration.steps import Steps
from identification.recording import Floats

TIMES = 25
"""Time constants that are tried, evenly in their logarithm, from half the time between two windows to ..."""
LONGEST = 30.0
"""... so many times the age of a reading: what is slower is a drift."""
ROUNDS = 3
LEAST = 1e-12
"""Of the largest force: scatter that no computation resolves."""


@dataclass(frozen=True, eq=False)
class Estimated:
    """The terms of one calibration, in SI, and how they follow from the means of the readings."""

    steps: Steps
    names: tuple[str, ...]
    theta: Floats
    """(p,)"""
    cov: Floats
    """(p, p) by the scatter."""
    solver: Floats
    """(p, n): change of the terms per N that the mean of a step changes."""
    residual: Floats
    """(n,) N, of the means."""
    leverage: Floats
    """(n,) of the means, 0 to 1."""
    scatter: float
    """N, standard deviation of one step's mean about the curve."""
    dof: float
    """Of the scatter: what the terms leave of the means."""

    def value(self, name: str) -> float:
        """0 for a term that is not there."""
        return float(self.theta[self.names.index(name)]) if name in self.names else 0.0

    def std(self, name: str) -> float:
        """By the scatter alone; NaN for a term that is not there."""
        at = self.names.index(name) if name in self.names else None
        return float("nan") if at is None else float(np.sqrt(self.cov[at, at]))


def estimated(steps: Steps) -> Estimated:
    """Raises ValueError with a sentence when the steps tell no gain."""
    names = with_creep(steps, terms_of(steps))
    if steps.count < len(names) + 2:
        raise ValueError(f"{steps.count} steps are too few: {len(names) + 2} are needed, better twice as many")
    found = _solved(steps, design_of(steps, names))
    if abs(found.value("gain")) < LEAST or not np.all(np.isfinite(found.theta)):
        raise ValueError("the reading does not change with the force: is the cell connected?")
    return found


def creep_time(steps: Steps) -> float:
    """s, time constant that the changes within the steps tell best, of a creep that is seen."""
    change = steps.value[:, -1] - steps.value[:, 0]
    apart = float(np.median(steps.time[:, -1] - steps.time[:, 0]))
    tried = np.geomspace(0.5 * apart, LONGEST * max(steps.age, apart), TIMES)
    drift = (steps.time[:, -1] - steps.time[:, 0]) / apart  # of the zero, which is no creep
    slow = [crept_beyond(steps, each) for each in tried]
    sums = [_left(np.column_stack([drift, each[:, -1] - each[:, 0]]), change) for each in slow]
    return float(tried[int(np.argmin(sums))])


def _left(columns: Floats, y: Floats) -> float:
    theta = np.linalg.lstsq(columns, y, rcond=None)[0]
    return float(np.sum((y - columns @ theta) ** 2))


def _solved(steps: Steps, design: Design) -> Estimated:
    n = steps.count
    mean, change = steps.mean, steps.value[:, -1] - steps.value[:, 0]
    creeps, ratio = any(name in CREEP for name in design.names), 1.0
    for _ in range(ROUNDS if creeps else 1):
        rows = np.vstack([design.means, design.changes / ratio]) if creeps else design.means
        y = np.concatenate([mean, change / ratio]) if creeps else mean
        inverse = np.linalg.pinv(rows)
        theta = inverse @ y
        residual = mean - design.means @ theta
        leverage = np.clip(np.einsum("ij,ji->i", design.means, inverse[:, :n]), 0.0, 1.0)
        dof = float(n - leverage.sum())
        scatter = max(float(np.sqrt(residual @ residual / dof)), LEAST * steps.reach)
        moved = change - design.changes @ theta
        noise = float(np.sqrt(moved @ moved / max(n - 2, 1)))
        ratio = float(np.clip(noise / scatter, 1e-3, 1e3))
    unit = design.unit
    return Estimated(
        steps,
        design.names,
        theta * unit,
        np.asarray(scatter**2 * (inverse @ inverse.T) * np.outer(unit, unit)),
        np.asarray(inverse[:, :n] * unit[:, None]),
        residual,
        leverage,
        scatter,
        dof,
    )
