"""Normal plot with a simulation envelope: what ordered residuals of the very same fit look like when errors are normal.

Residuals of a fit are neither independent nor of equal variance; the envelope allows for both by fitting simulated
normal errors in the same way (Atkinson, Plots, Transformations and Regression, 1985, section 4.2).
"""

from __future__ import annotations

import numpy as np

from identification.estimation.least_squares import Estimate
from identification.estimation.tails import normal_quantile
from identification.recording import Floats
from rig.report.regression_figures import NormalOrder

SIMULATIONS = 999
MOST = 200
"""Residuals in the plot; of more, every k-th is taken."""
SEED = 4141
"""Of the simulated errors: the same fit always gets the same envelope."""


def effective(estimate: Estimate) -> int:
    """How many independent residuals the even samples of a fit are worth; all of them where no correlation is known."""
    n = estimate.rows.y.size
    worth = sum(model.std**2 / model.mean_variance() for model in estimate.noise)
    return int(np.clip(worth, 10, n)) if estimate.noise else n


def normal_order(estimate: Estimate) -> NormalOrder | None:
    """Ordered standardised residuals and their pointwise 95 % envelope; None for fewer than 5 or a perfect fit."""
    rows, fit = estimate.rows, estimate.fit
    n = rows.y.size
    if n < 5 or fit.dof < 2 or not np.any(np.abs(fit.residual) > 1e-12 * np.abs(rows.y).max()):
        return None
    generator = np.random.default_rng(SEED)
    kept = min(n, MOST, effective(estimate))
    if kept < n:
        part = fit.residual[np.linspace(0, n - 1, kept).round().astype(np.intp)]
        return _order(part / part.std(), _studentised(generator.standard_normal((SIMULATIONS, kept))))
    sigma = np.ones(n)
    if rows.std_error is not None and fit.sigma2 is None:
        sigma = np.hypot(rows.std_error, estimate.excess_std or 0.0)
    hat = (rows.H / sigma[:, None]) @ (fit.solver * sigma)
    free = np.sqrt(np.maximum(1 - np.diag(hat), 1e-9))
    errors = generator.standard_normal((SIMULATIONS, n))
    simulated = (errors - errors @ hat.T) / free
    measured = fit.residual / sigma / free
    if fit.sigma2 is not None:
        return _order(_studentised(measured[None])[0], _studentised(simulated))
    return _order(measured, simulated)


def _studentised(rows: Floats) -> Floats:
    """Each row over its own root mean square."""
    out: Floats = rows / np.sqrt(np.mean(rows**2, axis=1, keepdims=True))
    return out


def _order(measured: Floats, simulated: Floats) -> NormalOrder:
    n = measured.size
    low, middle, high = np.quantile(np.sort(simulated, axis=1), (0.025, 0.5, 0.975), axis=0)
    rank = np.arange(1, n + 1, dtype=np.float64)
    quantile = normal_quantile((rank - 0.375) / (n + 0.25))  # Blom, Statistical Estimates, 1958
    return NormalOrder(quantile, np.sort(measured), low, middle, high)
