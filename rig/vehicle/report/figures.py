"""Figures of a vehicle: drag curve with the efficiency, a trial simulated against its measurement, inertia."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from identification.recording import Floats
from rig.report.regression_figures import Curve, Group, draw_curve, draw_groups
from rig.report.style import DATA, MODEL, MUTED, NARROW, PAPER, Plot, dots, drawable, labels, legend_above

MOST = 900
"""Samples of a trial that are drawn; of more, every k-th."""


def drag_curve(arriving: Group, nominal: Group | None, curve: Curve, x: str, y: str) -> Plot:
    """Force over velocity: what arrives (filled), what the tunnel promised (hollow), and the drag that balances it.

    `nominal` None: no efficiency was asked for, both are the same.
    """
    hollow = " Hollow points are what the tunnel calibration alone promises." if nominal is not None else ""
    alt = f"{y} over {x} in {arriving.x.size} steady runs, and the fitted drag with its 95 % band.{hollow}"

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        if nominal is not None:
            axes.plot(nominal.x, nominal.y, "s", color=MUTED, markerfacecolor=PAPER, label=nominal.label)
        draw_curve(axes, curve)
        draw_groups(axes, [arriving])
        labels(axes, x, y)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.8))


@dataclass(frozen=True, eq=False)
class Simulated:
    """One trial (n,): time in s, measured and simulated response in its unit."""

    title: str
    time: Floats
    measured: Floats
    simulated: Floats


def simulated_trial(trial: Simulated, y: str, x: str = "time / s") -> Plot:
    """Measured and simulated above; below, what is left, enlarged."""
    left = trial.measured - trial.simulated
    rms, step = float(np.sqrt(np.mean(left**2))), max(1, math.ceil(trial.time.size / MOST))
    alt = f"{trial.title}: {y} measured and simulated over {trial.time.size} samples; they differ by {rms:.3g} rms."

    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        dots(above, trial.time[::step], trial.measured[::step], DATA, 2.6, "measured")
        above.plot(*drawable(trial.time, trial.simulated), color=MODEL, label="simulated", zorder=3)
        below.axhline(0.0, color=MODEL, linewidth=1.2)
        dots(below, trial.time[::step], left[::step], DATA, 2.2)
        labels(above, "", y)
        labels(below, x, "difference")
        legend_above(above)
        for axes in (above, below):
            axes.margins(x=0.01)

    return Plot(draw, alt, (NARROW[0], 4.2))


def inertia_line(measured: Group, curve: Curve, x: str, y: str) -> Plot:
    """Acceleration over net force; the slope of the line is one over the inertia."""
    alt = f"{y} over {x}: {measured.x.size} smoothed samples about the line {curve.label}."

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        draw_groups(axes, [measured])
        draw_curve(axes, curve)
        labels(axes, x, y)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.6))
