"""A load cell against known forces: its gain with an interval, its hysteresis, and the step whose force is wrong.

reading = zero + gain F + b d 4 x (1 - x), x the share of the range between the smallest and the largest force, d = +1
where the force was reached by loading, -1 by unloading: a lag that closes at both ends of the range. By least squares;
the interval is Student's of the scatter, with what the forces themselves are uncertain by, which all steps share, added
in squares. A force that was entered wrongly is the largest externally studentised residual (Cook and Weisberg,
Residuals and Influence in Regression, 1982, 2.2.2), by Bonferroni.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from identification.estimation.tails import student_quantile, student_sf
from identification.recording import Floats

LEVEL = 0.95
WRONG = 0.01
"""Probability that some step of a sound calibration is called wrong."""
SPARE = 2
"""Steps beyond the parameters that are needed: one of them may be wrong, and the scatter is still known."""


@dataclass(frozen=True, slots=True)
class WrongForce:
    """One step whose reading does not go with the force that was entered."""

    step: int
    """From 0, as given."""
    entered: float
    """N"""
    expected: float
    """N, by its reading and the other steps."""
    p_value: float
    """Of so large a residual in any of the steps."""


@dataclass(frozen=True, slots=True)
class LoadCellCalibration:
    """Readings per N, unless said otherwise."""

    gain: float
    low: float
    high: float
    """95 % interval of the gain."""
    gain_std: float
    """Relative standard uncertainty, that of the forces included."""
    zero: float
    """Reading without a force."""
    hysteresis: float
    """Readings by which loading is above unloading in the middle of the range; negative: below it."""
    hysteresis_std: float
    scatter: float
    """Standard deviation of one reading about the curve."""
    wrong: WrongForce | None

    @property
    def scale(self) -> float:
        """N per reading."""
        return 1.0 / self.gain

    @property
    def offset(self) -> float:
        """N, to be added to scale times reading."""
        return -self.zero / self.gain


def calibrate(force: Floats, reading: Floats, force_std: float = 0.0) -> LoadCellCalibration:
    """From (n,) forces in N, in the order in which they were put on, and readings in any unit.

    `force_std`: relative standard uncertainty that all forces share. Raises ValueError for what tells no gain.
    """
    design = _design(force)
    n, p = design.shape
    if n < p + SPARE:
        raise ValueError(f"{n} steps are too few: {p + SPARE} are needed, better twice as many, up and down")
    if not (np.all(np.isfinite(force)) and np.all(np.isfinite(reading))):
        raise ValueError("forces and readings must be finite numbers")
    inverse: Floats = np.asarray(np.linalg.inv(design.T @ design), dtype=float)
    theta = inverse @ design.T @ reading
    residual = reading - design @ theta
    variance = float(residual @ residual) / (n - p)
    std = np.sqrt(variance * np.diag(inverse))
    gain = float(theta[1])
    if gain == 0.0:
        raise ValueError("the reading does not change with the force: is the cell connected?")
    known = force_std * abs(gain)
    total = hypot(float(std[1]), known)
    dof = (n - p) * (total / float(std[1])) ** 4 if std[1] > 0.0 else np.inf  # Welch and Satterthwaite
    half = float(student_quantile(0.5 + LEVEL / 2.0, min(dof, 1e6))) * total
    lag = float(theta[2]) if p > 2 else 0.0
    return LoadCellCalibration(
        gain=gain,
        low=gain - half,
        high=gain + half,
        gain_std=total / abs(gain),
        zero=float(theta[0]),
        hysteresis=2.0 * lag,
        hysteresis_std=2.0 * float(std[2]) if p > 2 else 0.0,
        scatter=float(np.sqrt(variance)),
        wrong=_wrong(design, force, reading, residual, inverse),
    )


def _design(force: Floats) -> Floats:
    """(n, 2) or, where the force went both ways between its ends, (n, 3)."""
    low, high = float(np.min(force)), float(np.max(force))
    if not high > low:
        raise ValueError("all forces are the same: at least two are needed to tell a gain")
    share = (force - low) / (high - low)
    way = np.sign(np.diff(force, prepend=force[0]))
    lag = way * 4.0 * share * (1.0 - share)
    columns = [np.ones_like(force), force]
    if np.any(lag > 0.0) and np.any(lag < 0.0):
        columns.append(lag)
    return np.column_stack(columns)


def _wrong(design: Floats, force: Floats, reading: Floats, residual: Floats, inverse: Floats) -> WrongForce | None:
    n, p = design.shape
    leverage = np.einsum("ij,jk,ik->i", design, inverse, design)
    spare = np.maximum(1.0 - leverage, 1e-9)
    without = (float(residual @ residual) - residual**2 / spare) / (n - p - 1)
    studentised = np.abs(residual) / np.sqrt(np.maximum(without, 1e-300) * spare)
    step = int(np.argmax(studentised))
    p_value = min(n * 2.0 * student_sf(float(studentised[step]), n - p - 1), 1.0)
    if p_value >= WRONG:
        return None
    others = np.arange(n) != step
    theta = np.linalg.lstsq(design[others], reading[others], rcond=None)[0]
    away = float(reading[step] - design[step] @ theta) / float(theta[1])
    return WrongForce(step, float(force[step]), float(force[step]) + away, p_value)
