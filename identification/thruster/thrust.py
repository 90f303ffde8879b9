"""Fit of a thruster model (thrust_forms.py) to all recordings of one thruster, one tare per recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal

import numpy as np

from identification.estimation.least_squares import Estimate, Method, estimate
from identification.estimation.tails import student_quantile
from identification.estimation.verdicts import Significance, Whiteness, significance, whiteness
from identification.recording import Floats, Recording
from identification.thruster.cell_error import CellError, cell_error
from identification.thruster.thrust_data import Run, Unusable, prepare
from identification.thruster.thrust_forms import FORMS, Form, Model
from identification.thruster.thrust_rows import rows_of

LEAST_ERROR = 1e-30
"""N; what is smaller has no reciprocal to weigh by, and no load cell reads it."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A fitted number; NaN std when the data do not determine it. 95 % interval `low`..`high` by t quantile."""

    value: float
    std: float
    """All of it: statistical and calibration, in quadrature."""
    unit: str
    std_statistical: float
    """Type A: from the scatter of this data."""
    std_calibration: float
    """Type B: the gain of the load cell, common to all points."""
    std_internal: float
    """What the standard errors of the points alone would give (eq. 4.9)."""
    dof: float
    low: float
    high: float
    std_uncorrected: float = float("nan")
    """What samples taken as uncorrelated would have given."""
    dof_calibration: float = float("inf")
    """Of `std_calibration`."""

    @property
    def dof_statistical(self) -> float:
        """Degrees of freedom of `std_statistical`: Welch-Satterthwaite undone."""
        if not self.std > 0:
            return self.dof
        known = self.dof * (self.std_calibration / self.std) ** 4 / self.dof_calibration
        return self.dof * (self.std_statistical / self.std) ** 4 / max(1.0 - known, 1e-12)


@dataclass(frozen=True, eq=False)
class ThrustFit:
    """One model fitted to all recordings of one thruster."""

    thruster: str
    model: str
    recordings: tuple[str, ...]
    voltage_quantity: str
    parameters: dict[str, Parameter]
    tare: dict[str, Parameter]
    """N, one per recording id."""
    difference: Significance | None
    """Of C+ - C-; None for the symmetric model and when only one direction was driven."""
    estimate: Estimate
    rmse: float
    """N, unweighted, of the rows that were fitted."""
    rmse_of: Literal["points", "samples"]
    sigma: float | None
    """N, standard deviation by eq. 4.12 when no standard error is known (then there is no chi-square)."""
    whiteness: Whiteness | None
    significance: dict[str, Significance]
    skipped: int
    unsteady: int
    runs: tuple[Run, ...] = field(repr=False)
    form: Form
    cov_statistical: Floats = field(repr=False)
    """(p, p) of `names`, scatter only; NaN where not determined."""
    cov_calibration: Floats | None = field(default=None, repr=False)
    """(p, p) of `names`, by the curve of the cell; None: its gain alone is known, and multiplies all alike."""

    @property
    def names(self) -> tuple[str, ...]:
        """Coefficients, then `tare[recording]`: the order of the covariance."""
        return self.estimate.rows.names

    @property
    def values(self) -> Floats:
        """(p,) of `names`."""
        return np.array([p.value for p in (*self.parameters.values(), *self.tare.values())])

    @property
    def cov(self) -> Floats:
        """(p, p) of `names`: scatter, and the calibration of the cell."""
        if self.cov_calibration is not None:
            return np.asarray(self.cov_statistical + self.cov_calibration)
        gain = np.array([p.std_calibration for p in (*self.parameters.values(), *self.tare.values())])
        shared = gain * np.sign(self.values)
        out: Floats = self.cov_statistical + np.outer(shared, shared)
        return out

    @property
    def chi2_per_dof(self) -> float | None:
        verdict = self.estimate.underfit
        return verdict.per_dof if verdict is not None and verdict.dof > 0 else None


def _uncorrected(found: Estimate, runs: Sequence[Run], contrast: Floats) -> float:
    """Standard deviation of contrast @ theta with every sample taken as independent of its neighbours."""
    rows = found.rows
    if rows.std_error is None or found.internal is None:
        return found.spread(contrast).internal
    points = [point.thrust for run in runs if run.points is not None for point in run.points.points]
    white = np.array([p.std_error * np.sqrt(min(p.n_effective / p.n, 1.0)) for p in points])
    return float(np.linalg.norm((contrast @ found.fit.solver) * white))


def _parameter(
    found: Estimate, runs: Sequence[Run], i: int, unit: str, gain: float, cell: CellError | None
) -> Parameter:
    contrast: Floats = np.eye(len(found.rows.names))[i]
    value, spread = float(contrast @ found.fit.theta), found.spread(contrast)
    calibration, known_dof = (abs(value) * gain, float("inf")) if cell is None else (cell.std(i), cell.dof)
    std = float(np.hypot(spread.std, calibration))
    dof = spread.dof
    if std > 0 and spread.std > 0 and np.isfinite(dof):  # Welch-Satterthwaite; a stated gain_std has infinite dof
        known = (calibration / std) ** 4 / known_dof
        dof = 1.0 / ((spread.std / std) ** 4 / spread.dof + known) if spread.dof > 0 else spread.dof
    half = float(student_quantile(0.975, dof)) * std if dof > 0 else float("nan")
    white = float("nan")
    if np.isfinite(spread.std):
        white = _uncorrected(found, runs, contrast)
    elif spread.dof == 0 and found.fit.dof > 0:
        value = float("nan")
    low, high = value - half, value + half
    return Parameter(value, std, unit, spread.std, calibration, spread.internal, dof, low, high, white, known_dof)


def _covariance(found: Estimate, stds: Floats, coefficients: int) -> Floats:
    """Statistical covariance (p, p) with these standard deviations (p,) on its diagonal.

    Correlations are those of the fit; with correlated samples those of the coefficients follow from the spread of
    their sums (var(a + b) - var(a - b) = 4 cov).
    """
    plain = np.sqrt(np.diag(found.fit.cov))
    with np.errstate(invalid="ignore", divide="ignore"):
        rho = np.nan_to_num(found.fit.cov / np.outer(plain, plain))
    unit = np.eye(stds.size)
    for i, j in combinations(range(coefficients if found.noise else 0), 2):
        a, b = unit[i] / stds[i], unit[j] / stds[j]
        if np.all(np.isfinite(a)) and np.all(np.isfinite(b)):
            both = (found.spread(a + b).std ** 2 - found.spread(a - b).std ** 2) / 4
            rho[i, j] = rho[j, i] = float(np.clip(both, -1.0, 1.0))
    np.fill_diagonal(rho, 1.0)
    values, vectors = np.linalg.eigh(rho)
    rho = (vectors * np.maximum(values, 0.0)) @ vectors.T
    scale = stds / np.sqrt(np.diag(rho))
    out: Floats = rho * np.outer(scale, scale)
    return out


def _not_told(runs: Sequence[Run], found: Estimate, form: Form) -> Unusable | None:
    """Why none of the coefficients can be had, when that is so."""
    lost, count = found.fit.deficiency, found.rows.y.size
    if lost is None or not all(name in lost.names for name in form.coefficients):
        return None
    ids = ", ".join(run.recording_id for run in runs)
    if count < len(found.rows.names):
        wanted = ", ".join(found.rows.names)
        return Unusable(
            f"recording {ids}: {count} {'hold' if count == 1 else 'holds or samples'} for "
            f"{len(found.rows.names)} parameters ({wanted}); measure at least one more level than parameters"
        )
    levels = np.unique(np.concatenate([run.voltage for run in runs]).round(6))
    what, unit = ("rotation rate", "rev/s") if runs[0].voltage_quantity == "rotation_rate" else ("voltage", "V")
    seen = f"{levels.size} level(s) from {levels[0]:g} to {levels[-1]:g} {unit}"
    return Unusable(f"recording {ids}: {lost.statement}; the {what} shows {seen}, at least two are needed")


def _unfit(runs: Sequence[Run], model: Model) -> Unusable | None:
    """Why these runs cannot be fitted together with this model."""
    by_rate = [run.voltage_quantity == "rotation_rate" for run in runs]
    if any(by_rate) and not all(by_rate):
        return Unusable(
            f"recordings {', '.join(run.recording_id for run in runs)}: some have a voltage, some only a "
            "rotation rate; "
            "choose what all of them have (rotation_rate), or fit them apart"
        )
    form = FORMS[model, by_rate[0]]
    still = [run.recording_id for run in runs if run.flow is None]
    if form.with_flow and still:
        return Unusable(f"recording {', '.join(still)}: no flow_speed was recorded; {form.name} needs the flow U")
    return None


def _without_scatter(runs: Sequence[Run], std_error: Floats | None) -> Unusable | None:
    """A point without any error among others that have some would have all the weight."""
    if std_error is None or np.all(std_error > LEAST_ERROR):
        return None
    return Unusable(
        f"recording {', '.join(run.recording_id for run in runs)}: at a level thrust has a standard error of "
        f"{float(std_error.min()):.3g} N: its samples there stand still or are damaged; leave these rows out"
    )


def fit_runs(runs: Sequence[Run], model: Model = "C V|V|", method: Method = "wls") -> ThrustFit | Unusable:
    """Fit prepared runs of one thruster jointly; see `fit_thrust`."""
    refused = _unfit(runs, model)
    if refused is not None:
        return refused
    form = FORMS[model, runs[0].voltage_quantity == "rotation_rate"]
    rows, rmse_of = rows_of(runs, form)
    refused = _without_scatter(runs, rows.std_error)
    if refused is not None:
        return refused
    found = estimate(rows, method)
    refused = _not_told(runs, found, form)
    if refused is not None:
        return refused
    names, unit = form.coefficients, np.eye(len(rows.names))
    gain = max(run.gain_std for run in runs)
    cell = cell_error(found, runs)
    parameters = {name: _parameter(found, runs, i, form.units[i], gain, cell) for i, name in enumerate(names)}
    tare = {
        run.recording_id: _parameter(found, runs, len(names) + k, "N", run.gain_std, cell) for k, run in enumerate(runs)
    }
    stds = np.array([p.std_statistical for p in (*parameters.values(), *tare.values())])
    residual = found.fit.residual
    return ThrustFit(
        runs[0].thruster,
        form.name,
        tuple(run.recording_id for run in runs),
        runs[0].voltage_quantity,
        parameters,
        tare,
        _difference(found, unit) if form.split else None,
        found,
        float(np.sqrt(np.mean(residual**2))),
        rmse_of,
        None if found.fit.sigma2 is None else float(np.sqrt(found.fit.sigma2)),
        whiteness(residual),
        {name: significance(p.value, p.std_statistical, p.dof_statistical) for name, p in parameters.items()},
        sum(run.skipped for run in runs),
        sum(run.points.unsteady for run in runs if run.points is not None),
        tuple(runs),
        form,
        _covariance(found, stds, len(names)),
        None if cell is None else cell.cov,
    )


def _difference(found: Estimate, unit: Floats) -> Significance | None:
    contrast = unit[0] - unit[1]
    spread = found.spread(contrast)
    if not np.isfinite(spread.std):
        return None
    return significance(float(contrast @ found.fit.theta), spread.std, spread.dof)


def fit_thrust(
    recordings: Sequence[Recording],
    model: Model = "C V|V|",
    voltage: str = "command_voltage",
    method: Method = "wls",
) -> ThrustFit | Unusable:
    """Fit tau = C V|V| + tare (eq. 4.14) to all recordings of one thruster.

    `voltage` is the quantity of the regressor; `command_voltage` falls back to `motor_voltage`, then `rotation_rate`.
    Input that cannot be used comes back as `Unusable`, never as an exception.

    >>> t = np.arange(0.0, 60.0, 0.02)
    >>> V = np.repeat([0.0, 4.0, 8.0, -4.0, -8.0, 0.0], 500)
    >>> F = 0.4 * V * abs(V) + 1.5 + np.random.default_rng(0).normal(0, 0.1, t.size)
    >>> from identification.recording import Channel
    >>> channels = (Channel("u", "command", "command_voltage", "V", t, V), Channel("f", "cell", "thrust", "N", t, F))
    >>> fit = fit_thrust([Recording("a", "T1", channels)])
    >>> round(fit.parameters["C"].value, 3), round(fit.tare["a"].value, 2), fit.rmse_of
    (0.4, 1.5, 'points')
    """
    if not recordings:
        return Unusable("no recording was given; expected at least one")
    runs = [prepare(recording, voltage) for recording in recordings]
    ready = [run for run in runs if isinstance(run, Run)]
    refused = [run for run in runs if isinstance(run, Unusable)]
    return refused[0] if refused else fit_runs(ready, model, method)
