"""The thruster model tau = C V|V| (eq. 4.14) or tau = C_t n|n|, one coefficient or two, one tare per recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.stats import t as student

from identification.estimation import Estimate, Method, Rows, estimate
from identification.pooling import moderate
from identification.recording import Floats, Recording
from identification.thrust_data import Run, Unusable, prepare
from identification.verdicts import Significance, Whiteness, significance, whiteness

Model = Literal["C V|V|", "C+/C-"]
"""One coefficient, or one for each direction."""
HARDLY_DRIVEN = 0.05
"""Share of the other direction's largest voltage or rate up to which a direction counts as not driven."""


@dataclass(frozen=True, slots=True)
class Form:
    """How a model is called, its coefficients and their unit."""

    name: str
    coefficients: tuple[str, ...]
    unit: str


FORMS: dict[tuple[Model, bool], Form] = {
    ("C V|V|", False): Form("C V|V|", ("C",), "N/V^2"),
    ("C+/C-", False): Form("C+/C-", ("C_plus", "C_minus"), "N/V^2"),
    ("C V|V|", True): Form("C_t n|n|", ("C_t",), "N.s^2"),
    ("C+/C-", True): Form("C_t+/C_t-", ("C_t_plus", "C_t_minus"), "N.s^2"),
}
"""By model and whether it is explained by rotation rate n in rev/s (thesis section 4.2.2: tau = C_t n|n|)."""


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

    @property
    def chi2_per_dof(self) -> float | None:
        verdict = self.estimate.underfit
        return verdict.per_dof if verdict is not None and verdict.dof > 0 else None


def _directions(square: Floats) -> list[Floats]:
    """V|V| of each direction; one that was hardly driven (noise about rest, an overshoot) tells nothing: zeros."""
    sides = [np.maximum(square, 0.0), np.minimum(square, 0.0)]
    most = max(float(np.abs(side).max()) for side in sides)
    return [side if np.abs(side).max() > HARDLY_DRIVEN**2 * most else np.zeros_like(side) for side in sides]


def rows_of(runs: Sequence[Run], form: Form) -> tuple[Rows, Literal["points", "samples"]]:
    """Stack the runs: V|V| per direction, one column of ones per recording; points if every run has holds."""
    points = [run.points for run in runs if run.points is not None]
    of_points = len(points) == len(runs)
    V = [p.voltage for p in points] if of_points else [run.voltage for run in runs]
    y = [p.thrust for p in points] if of_points else [run.thrust for run in runs]
    ends = np.cumsum([0, *[v.size for v in V]])
    blocks = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    square = np.concatenate([v * np.abs(v) for v in V])
    columns = [square] if len(form.coefficients) == 1 else _directions(square)
    tares = np.zeros((square.size, len(runs)))
    for k, block in enumerate(blocks):
        tares[block, k] = 1.0
    names = (*form.coefficients, *(f"tare[{run.recording_id}]" for run in runs))
    H, thrust = np.column_stack([*columns, tares]), np.concatenate(y)
    if not of_points:
        return Rows(H, thrust, names, blocks, even=True), "samples"
    error = np.concatenate([p.std_error for p in points])
    if not np.all(np.isfinite(error) & (error > 0)):
        return Rows(H, thrust, names, blocks, even=True), "points"
    dof = np.concatenate([p.dof for p in points])
    shared = moderate(error, dof, np.abs(thrust))
    return Rows(H, thrust, names, blocks, shared.std_error, shared.dof, float(dof.max())), "points"


def _parameter(found: Estimate, contrast: Floats, unit: str, gain: float) -> Parameter:
    value, spread = float(contrast @ found.fit.theta), found.spread(contrast)
    calibration = abs(value) * gain
    std = float(np.hypot(spread.std, calibration))
    dof = spread.dof
    if std > 0 and spread.std > 0 and np.isfinite(dof):
        dof = spread.dof * (std / spread.std) ** 4  # Welch-Satterthwaite: the type B part has infinite dof
    half = float(student.ppf(0.975, dof)) * std if dof > 0 else float("nan")
    if not np.isfinite(spread.std):
        value = float("nan") if spread.dof == 0 and found.fit.dof > 0 else value
    return Parameter(value, std, unit, spread.std, calibration, spread.internal, dof, value - half, value + half)


def fit_runs(runs: Sequence[Run], model: Model = "C V|V|", method: Method = "wls") -> ThrustFit | Unusable:
    """Fit prepared runs of one thruster jointly; see `fit_thrust`."""
    by_rate = [run.voltage_quantity == "rotation_rate" for run in runs]
    if any(by_rate) and not all(by_rate):
        return Unusable(
            f"recordings {', '.join(run.recording_id for run in runs)}: some have a voltage, some only a "
            "rotation rate; "
            "choose what all of them have (rotation_rate), or fit them apart"
        )
    form = FORMS[model, by_rate[0]]
    rows, rmse_of = rows_of(runs, form)
    found = estimate(rows, method)
    lost = found.fit.deficiency
    names = form.coefficients
    if lost is not None and all(name in lost.names for name in names):
        levels = np.unique(np.concatenate([run.voltage for run in runs]).round(6))
        ids = ", ".join(run.recording_id for run in runs)
        what, suffix = ("rotation rate", "rev/s") if by_rate[0] else ("voltage", "V")
        seen = f"{levels.size} level(s) from {levels[0]:g} to {levels[-1]:g} {suffix}"
        return Unusable(f"recording {ids}: {lost.statement}; the {what} shows {seen}, at least two are needed")
    gain = max(run.gain_std for run in runs)
    unit = np.eye(len(rows.names))
    parameters = {name: _parameter(found, unit[i], form.unit, gain) for i, name in enumerate(names)}
    tare = {run.recording_id: _parameter(found, unit[len(names) + k], "N", run.gain_std) for k, run in enumerate(runs)}
    known = {name: significance(p.value, p.std_statistical, p.dof) for name, p in parameters.items()}
    residual = found.fit.residual
    return ThrustFit(
        runs[0].thruster,
        form.name,
        tuple(run.recording_id for run in runs),
        runs[0].voltage_quantity,
        parameters,
        tare,
        _difference(found, unit) if len(names) == 2 else None,
        found,
        float(np.sqrt(np.mean(residual**2))),
        rmse_of,
        None if found.fit.sigma2 is None else float(np.sqrt(found.fit.sigma2)),
        whiteness(residual),
        known,
        sum(run.skipped for run in runs),
        sum(run.points.unsteady for run in runs if run.points is not None),
        tuple(runs),
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
