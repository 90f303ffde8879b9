"""The running fit of a sweep: thrust = C V|V| + tare from the holds finished so far, weighted by standard errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from identification.estimation.least_squares import Rows, estimate
from identification.steady_state.pooling import moderate
from identification.thruster.thrust_report import MISFIT_P
from rig.link.front_end_messages import Point

COVERAGE: Final = 2
"""k: standard deviations in what stands behind ±."""


@dataclass(frozen=True, slots=True)
class RunningFit:
    """What the holds so far say. A first look: the verdict over the whole recording is `rig fit`."""

    C: float
    """N/V^2"""
    C_std: float
    """N/V^2, one sigma, of the scatter of the points and not of the cell's calibration; inf for two points."""
    tare: float
    """N, left over after the tare that was subtracted."""
    used: int
    left_out: int
    """Points without a usable standard error."""
    per_dof: float | None = None
    """chi-square per degree of freedom; None for two points."""
    misfit: float | None = None
    """The same, where points scatter more than their standard errors allow at MISFIT_P."""

    def predict(self, v_abs_v: float) -> float:
        """N at V|V| in V^2."""
        return self.C * v_abs_v + self.tare


def usable(point: Point) -> bool:
    """A weight needs a finite, positive standard error."""
    return math.isfinite(point.thrust) and math.isfinite(point.std_error) and point.std_error > 0.0


def v_abs_v(point: Point) -> float:
    """V|V| in V^2."""
    return point.voltage * abs(point.voltage)


@lru_cache(maxsize=16)
def running_fit(points: tuple[Point, ...]) -> RunningFit | None:
    """Weighted least squares of `estimation.least_squares`; None until two different values of V|V| have a point."""
    chosen = [point for point in points if usable(point)]
    x = np.array([v_abs_v(point) for point in chosen])
    if len(np.unique(x)) < 2:
        return None
    thrust = np.array([point.thrust for point in chosen])
    errors = np.array([point.std_error for point in chosen])
    shared = moderate(errors, np.array([point.dof for point in chosen]), np.abs(thrust))
    columns = np.column_stack([x, np.ones_like(x)])
    rows = Rows(columns, thrust, ("C", "tare"), (slice(0, len(chosen)),), shared.std_error, shared.dof)
    found = estimate(rows)
    fit, judged = found.fit, found.underfit
    std = float(fit.std[0]) if fit.dof > 0 else math.inf
    per_dof = judged.per_dof if judged is not None and judged.dof > 0 else None
    misfit = per_dof if judged is not None and judged.p_value < MISFIT_P else None
    left_out = len(points) - len(chosen)
    return RunningFit(float(fit.theta[0]), std, float(fit.theta[1]), len(chosen), left_out, per_dof, misfit)


def in_words(fit: RunningFit | None) -> str:
    """`C = 0.4012 ± 0.0042 N/V² (k = 2, n = 12), chi²/dof 1.3`, with the digits that its standard deviation allows."""
    if fit is None:
        return "no fit yet: two levels are needed"
    if not math.isfinite(fit.C_std):
        return f"C = {fit.C:.3g} N/V² (n = 2, spread not known yet)"
    digits = decimals(fit.C_std)
    judged = f", chi²/dof {fit.per_dof:.2g}" if fit.per_dof is not None else ""
    return f"C = {fit.C:.{digits}f} ± {COVERAGE * fit.C_std:.{digits}f} N/V² (k = {COVERAGE}, n = {fit.used}){judged}"


def decimals(std: float) -> int:
    """Digits after the point that show two significant digits of a standard deviation."""
    if not math.isfinite(std) or std <= 0.0:
        return 4
    return max(0, 1 - math.floor(math.log10(std)))
