"""Pictures of a thrust fit: measured and fitted, residuals over voltage and in time, normal plot, singular values."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from identification.estimation.tails import student_quantile
from identification.recording import Floats
from identification.thruster.thrust import Parameter, ThrustFit
from rig.report import regression_figures
from rig.report.normal_plot import normal_order
from rig.report.page import Picture
from rig.report.regression_figures import Curve, Group

GRID = 121
MOST, MOST_EACH = 1500, 300
"""Samples drawn of a single recording, and of each of several; of more, every k-th."""
QUANTITY = {
    "command_voltage": "command voltage / V",
    "motor_voltage": "motor voltage / V",
    "rotation_rate": "rotation rate / (rev/s)",
}


def pictures(fit: ThrustFit) -> tuple[Picture, ...]:
    """Fit, residuals over voltage and over time, normal plot, singular values."""
    order, solved = normal_order(fit.estimate), fit.estimate.fit
    out = [
        measured_and_fitted(fit),
        residuals_by_level(fit),
        residuals_in_order(fit),
        Picture(
            "Singular values of the regressor",
            regression_figures.singular_values(solved.singular_values, solved.condition),
            "What the sweep excites: a value far below the others is a combination it hardly shows. The condition "
            "number is that of the scaled columns; above 100 is poor.",
        ),
    ]
    if order is not None:
        out.insert(
            3, Picture("Normal plot", regression_figures.normal_plot(order), _normal_caption(fit, order.ordered.size))
        )
    return tuple(out)


def measured_and_fitted(fit: ThrustFit) -> Picture:
    """Thrust less tare over what explains it, the fitted curve, and its 95 % band of scatter and calibration."""
    thin = _thinning(fit)
    kept = f" One sample in {thin} is drawn." if thin > 1 else ""
    few = fit.estimate.rows.std_error is not None and fit.estimate.rows.y.size <= regression_figures.MANY
    bars = " Bars are 95 % intervals of each point." if few else ""
    return Picture(
        "Measured and fitted thrust",
        regression_figures.fit_band(_measured(fit), _curve(fit), QUANTITY[fit.voltage_quantity], _less(fit)),
        f"The band holds scatter and calibration; where it is not seen it is narrower than the line.{bars}{kept}",
    )


def residuals_by_level(fit: ThrustFit) -> Picture:
    """What the model leaves, over what explains the thrust, with the band of the fit's own scatter."""
    x = QUANTITY[fit.voltage_quantity]
    return Picture(
        "Residuals over what explains the thrust",
        regression_figures.residuals(_residuals(fit), x, "residual / N", _scatter_band(fit, _curve(fit).x)),
        "A shape here is physics that the model leaves out. The band is what scatter alone leaves open.",
    )


def residuals_in_order(fit: ThrustFit) -> Picture:
    """What the model leaves, in the order in which it was measured."""
    return Picture(
        "Residuals in the order of measurement",
        regression_figures.residuals(_residuals(fit, over_time=True), _time_label(fit), "residual / N", wide=True),
        "A trend or a wave here is drift, warming up or slow noise.",
    )


def _normal_caption(fit: ThrustFit, drawn: int) -> str:
    n = fit.estimate.rows.y.size
    worth = f" {drawn} of {n} residuals, spread evenly: no more than are worth independent ones." if drawn < n else ""
    return f"On the line and inside the band the errors are normal; each is over its standard error.{worth}"


def _main(fit: ThrustFit) -> int:
    """How many coefficients multiply the square of what explains: one, or one for each direction; flow comes after."""
    return sum(name.endswith(("_plus", "_minus")) for name in fit.parameters) or 1


def _of(fit: ThrustFit, x: Floats) -> list[Parameter]:
    """The coefficient that counts at each voltage."""
    found = list(fit.parameters.values())[: _main(fit)]
    return [found[0] if V >= 0 or len(found) == 1 else found[1] for V in x]


def _curve(fit: ThrustFit) -> Curve:
    """At each voltage one coefficient counts; its interval, calibration included, is the band."""
    V = np.concatenate([_explaining(fit, k) for k in range(len(fit.runs))])
    x = np.linspace(min(float(V.min()), 0.0), max(float(V.max()), 0.0), GRID)
    square = x * np.abs(x)
    value = np.array([p.value for p in _of(fit, x)]) * square
    half = np.array([(p.high - p.low) / 2 for p in _of(fit, x)]) * np.abs(square)
    return Curve(fit.model, x, value, value - half, value + half)


def _scatter_band(fit: ThrustFit, x: Floats) -> Curve:
    """About zero, from the scatter alone: an error of the cell's gain moves points and curve together."""
    half = np.array([(p.high - p.low) / 2 * _share(p) for p in _of(fit, x)]) * x**2
    return Curve("95 % band of the fit", x, 0 * x, -half, half)


def _share(p: Parameter) -> float:
    return p.std_statistical / p.std if p.std > 0 else 0.0


def _explaining(fit: ThrustFit, k: int) -> Floats:
    run = fit.runs[k]
    return run.points.voltage if run.points is not None and fit.rmse_of == "points" else run.voltage


def _thinning(fit: ThrustFit) -> int:
    blocks = fit.estimate.rows.blocks
    longest = max(int(block.stop - block.start) for block in blocks)
    return max(1, math.ceil(longest / (MOST if len(blocks) == 1 else MOST_EACH)))


def _groups(fit: ThrustFit, x: Sequence[Floats], y: Sequence[Floats]) -> list[Group]:
    rows = fit.estimate.rows
    step, out = _thinning(fit), []
    half = None
    if rows.std_error is not None:
        wide = student_quantile(0.975, rows.dof) if rows.dof is not None else 1.96
        half = wide * rows.std_error
    for k, block in enumerate(rows.blocks):
        label = "measured" if len(rows.blocks) == 1 else f"recording {k + 1}"
        out.append(Group(label, x[k][::step], y[k][::step], None if half is None else half[block][::step]))
    return out


def _less(fit: ThrustFit) -> str:
    return "thrust less tare and flow / N" if len(fit.parameters) > _main(fit) else "thrust less tare / N"


def _measured(fit: ThrustFit) -> list[Group]:
    """Thrust without what the curve does not show: tares, and the term of the flow where there is one."""
    rows, solved = fit.estimate.rows, fit.estimate.fit
    others = slice(_main(fit), None)
    shown = rows.y - rows.H[:, others] @ solved.theta[others]
    return _groups(fit, [_explaining(fit, k) for k in range(len(fit.runs))], [shown[block] for block in rows.blocks])


def _time_label(fit: ThrustFit) -> str:
    return "time since the recording began / s" if fit.rmse_of == "points" else "number of the sample, in order"


def _residuals(fit: ThrustFit, *, over_time: bool = False) -> list[Group]:
    blocks = fit.estimate.rows.blocks
    y = [fit.estimate.fit.residual[block] for block in blocks]
    x = [_explaining(fit, k) for k in range(len(blocks))]
    if over_time:
        x = [np.arange(block.stop - block.start, dtype=np.float64) for block in blocks]
        for k, run in enumerate(fit.runs):
            if fit.rmse_of == "points" and run.points is not None:
                x[k] = np.array([0.5 * (p.thrust.t_start + p.thrust.t_end) for p in run.points.points])
    return _groups(fit, x, y)
