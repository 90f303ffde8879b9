"""Figures of a regression: curve with its band, residuals, normal plot, singular values, intervals side by side.

All take arrays and give a `Plot`; none knows where the numbers came from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.recording import Floats
from rig.report.style import BAND, DATA, INK, MODEL, MUTED, NARROW, PAPER, SERIES, Plot, dots, labels, legend_above

MANY = 200
"""More points than this are dots without error bars."""


@dataclass(frozen=True, eq=False)
class Group:
    """Points drawn alike, (n,): `half` is the half width of the 95 % interval, in the unit of y."""

    label: str
    x: Floats
    y: Floats
    half: Floats | None = None


@dataclass(frozen=True, eq=False)
class Curve:
    """A model with its 95 % band, (n,), x ascending."""

    label: str
    x: Floats
    y: Floats
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True, slots=True)
class Interval:
    """One line of a forest plot."""

    name: str
    value: float
    low: float
    high: float


def draw_groups(axes: Axes, groups: Sequence[Group]) -> None:
    """Points of each group with its own colour and marker; more groups than there are markers share the last."""
    for i, group in enumerate(groups):
        colour, marker = SERIES[min(i, len(SERIES) - 1)]
        name = group.label if i < len(SERIES) else "_"
        if group.x.size > MANY and len(groups) == 1:
            dots(axes, group.x, group.y, colour, 1.8, name)
        elif group.x.size > MANY:
            axes.plot(group.x, group.y, marker, color=colour, label=name, markersize=3, fillstyle="none", mew=0.7)
        elif group.half is None or not np.any(np.isfinite(group.half)):
            axes.plot(group.x, group.y, marker, color=colour, label=name)
        else:
            half = np.nan_to_num(group.half)
            axes.errorbar(group.x, group.y, half, fmt=marker, color=colour, label=name, elinewidth=1.2)


def draw_curve(axes: Axes, curve: Curve, dash: str = "-") -> None:
    """Band below, line above."""
    if curve.low is not None and curve.high is not None:
        axes.fill_between(curve.x, curve.low, curve.high, color=BAND, linewidth=0, zorder=1)
    axes.plot(curve.x, curve.y, dash, color=MODEL, label=curve.label, zorder=2.5)


def fit_band(groups: Sequence[Group], curve: Curve, x: str, y: str) -> Plot:
    """Measured points and the fitted curve with its confidence band."""
    count = sum(group.x.size for group in groups)
    span = f"{min(g.x.min() for g in groups):.3g} to {max(g.x.max() for g in groups):.3g}"
    alt = f"{y} over {x}: {count} measured values from {span}, and the curve {curve.label} with its 95 % band."

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        draw_groups(axes, groups)
        draw_curve(axes, curve)
        labels(axes, x, y)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.6))


def residuals(groups: Sequence[Group], x: str, y: str, band: Curve | None = None, *, wide: bool = False) -> Plot:
    """Residuals about zero, over anything. `band`: what the fit itself is not sure of, about zero."""
    largest = max(float(np.abs(g.y).max()) for g in groups)
    alt = f"{y} over {x}: {sum(g.x.size for g in groups)} residuals about zero, the largest {largest:.3g}."

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        if band is not None and band.low is not None and band.high is not None:
            axes.fill_between(band.x, band.low, band.high, color=BAND, linewidth=0, zorder=1, label=band.label)
        axes.axhline(0.0, color=MODEL, linewidth=1.2, zorder=1.5)
        draw_groups(axes, groups)
        labels(axes, x, y)
        axes.margins(y=0.12)
        legend_above(axes)

    return Plot(draw, alt, NARROW, (9.0, 3.0) if wide else None)


@dataclass(frozen=True, eq=False)
class NormalOrder:
    """Ordered standardised residuals (n,) and what normal ones would give: median and 95 % envelope, each (n,)."""

    quantile: Floats
    ordered: Floats
    low: Floats
    middle: Floats
    high: Floats

    @property
    def outside(self) -> int:
        return int(np.sum((self.ordered < self.low) | (self.ordered > self.high)))


def normal_plot(order: NormalOrder) -> Plot:
    """Q-Q plot against the normal law, with the envelope of simulated residuals of the same fit."""
    n = order.ordered.size
    alt = f"Normal plot of {n} standardised residuals; {order.outside} lie outside the simulated 95 % envelope."

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.fill_between(
            order.quantile, order.low, order.high, color=BAND, linewidth=0, label="95 % of simulated fits"
        )
        axes.plot(order.quantile, order.middle, color=MODEL, linewidth=1.2)
        axes.plot(order.quantile, order.ordered, "o", color=DATA, label="residuals", markersize=4 if n < 100 else 2.5)
        labels(axes, "normal quantile", "standardised residual")
        legend_above(axes)

    return Plot(draw, alt)


def singular_values(values: Floats, condition: float) -> Plot:
    """Singular values (p,) of the regressor as weighted, largest first, on a logarithmic scale."""
    shown = ", ".join(f"{value:.3g}" for value in values)
    alt = f"Singular values of the regressor: {shown}; condition number of the scaled regressor {condition:.3g}."
    seen = values > 1e-15 * values.max()

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        at = np.arange(1, values.size + 1)
        bottom = float(values[seen].min()) / 10
        axes.set_yscale("log")
        axes.vlines(at[seen], bottom, values[seen], color=DATA, linewidth=2.5)
        axes.plot(at[seen], values[seen], "o", color=DATA, markersize=7)
        axes.plot(at[~seen], np.full(int((~seen).sum()), bottom * 1.3), "x", color=MODEL, markersize=8)
        for i, value in zip(at[seen], values[seen], strict=True):
            axes.annotate(f"{value:.3g}", (i, value), (0, 8), textcoords="offset points", ha="center")
        axes.set_ylim(bottom, float(values.max()) * 5)
        axes.set_xlim(0.4, values.size + 0.6)
        labels(axes, "number, largest first", "singular value")
        axes.set_xticks(at if values.size <= 8 else at[:: int(np.ceil(values.size / 8))])
        axes.set_title(f"condition number {condition:.3g}")

    return Plot(draw, alt)


def forest(rows: Sequence[Interval], x: str, reference: float | None = None) -> Plot:
    """Values with their 95 % intervals, one below the other; `reference` is a dashed line. NaN: not determined."""
    told = "; ".join(f"{row.name} {row.value:.4g} ({row.low:.4g} to {row.high:.4g})" for row in rows)
    alt = f"{x} with 95 % intervals: {told}."

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        if reference is not None:
            axes.axvline(reference, color=MUTED, linestyle="--", linewidth=1.2)
        for i, row in enumerate(rows):
            if np.isfinite(row.low + row.high):
                axes.plot([row.low, row.high], [i, i], color=DATA, linewidth=2.2)
                axes.plot([row.low, row.high], [i, i], "|", color=DATA, markersize=9)
            if np.isfinite(row.value):
                known = np.isfinite(row.low + row.high)
                axes.plot(row.value, i, "o", color=DATA, markerfacecolor=DATA if known else PAPER, markersize=6)
            else:
                axes.annotate("not determined", (0.5, i), xycoords=("axes fraction", "data"), ha="center", color=INK)
        labels(axes, x, "")
        axes.set_yticks(range(len(rows)), [row.name for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.grid(visible=False, axis="y")

    return Plot(draw, alt, (NARROW[0], 0.85 + 0.3 * len(rows)))
