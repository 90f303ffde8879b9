"""What the calibration of the load cell makes of a fit: one error of the curve in all points that share it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.least_squares import Estimate
from identification.recording import Floats
from identification.thruster.thrust_data import Run


@dataclass(frozen=True, eq=False)
class CellError:
    """Of the p parameters of a fit, by calibrations."""

    cov: Floats
    """(p, p)"""
    dof: float
    """The fewest effective degrees of freedom of the curves."""

    def std(self, i: int) -> float:
        return float(np.sqrt(self.cov[i, i]))


def cell_error(found: Estimate, runs: Sequence[Run]) -> CellError | None:
    """None where no run's thrust was read by a curve with a covariance: one relative number is then all there is.

    The error of a force is `Curve.effects`, that of a run which only states `gain_std` its share of the force.
    """
    if all(run.curve is None for run in runs):
        return None
    rows, theta = found.rows, found.fit.theta
    first = len(rows.names) - len(runs)
    cov = np.zeros((theta.size, theta.size))
    for calibration in dict.fromkeys(run.calibration for run in runs):
        parts = []
        for k, run in enumerate(runs):
            force = rows.y[rows.blocks[k]] - theta[first + k]
            if run.calibration == calibration:
                effect = force[:, None] * run.gain_std if run.curve is None else run.curve.effects(force)
                parts.append(found.fit.solver[:, rows.blocks[k]] @ effect)
        made = sum(parts[1:], parts[0])
        cov += made @ made.T
    return CellError(cov, min(run.curve.dof for run in runs if run.curve is not None))
