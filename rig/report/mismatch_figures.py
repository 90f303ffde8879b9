"""Figures of what a model leaves out: where (map over voltage and time), what (signature), and what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from identification.recording import Floats
from rig.report.regression_figures import Curve, Group, draw_curve, draw_groups
from rig.report.style import DATA, INK, MODEL, MUTED, NARROW, PAPER, STEPS, Plot, drawable, labels, legend_above

CELLS = (24, 14)
"""Most columns (time) and rows (voltage) of a map: each cell must be seen on a phone."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Means of a residual in cells: `value` (rows, columns), NaN where nothing was measured; edges one longer."""

    time: Floats
    voltage: Floats
    value: Floats


@dataclass(frozen=True, slots=True)
class Region:
    """A located part of the map; None: that side is open."""

    label: str
    time: tuple[float, float] | None = None
    voltage: tuple[float, float] | None = None


def grid_of(time: Floats, voltage: Floats, residual: Floats, cells: tuple[int, int] = CELLS) -> Grid:
    """Mean residual (n,) in cells of equal width over time (s) and voltage (V), all (n,).

    >>> t = np.array([0.0, 1.0, 2.0, 3.0])
    >>> grid_of(t, t, np.array([1.0, 3.0, 5.0, 7.0]), (2, 1)).value.tolist()
    [[2.0, 6.0]]
    """
    good = np.isfinite(time) & np.isfinite(voltage) & np.isfinite(residual)
    t, V, r = time[good], voltage[good], residual[good]
    t_edges = np.linspace(t.min(), max(t.max(), t.min() + 1e-9), cells[0] + 1)
    V_edges = np.linspace(V.min(), max(V.max(), V.min() + 1e-9), cells[1] + 1)
    count, _, _ = np.histogram2d(V, t, (V_edges, t_edges))
    total, _, _ = np.histogram2d(V, t, (V_edges, t_edges), weights=r)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return Grid(t_edges, V_edges, mean)


def residual_map(
    grid: Grid,
    region: Region | None = None,
    value: str = "residual / N",
    x: str = "time / s",
    y: str = "command voltage / V",
) -> Plot:
    """Heat map over voltage and time: nine colours, and the sign written into each cell that stands out."""
    found = grid.value[np.isfinite(grid.value)]
    top = float(np.abs(found).max()) if found.size else 1.0
    marked = f" The region {region.label} is outlined." if region is not None else ""
    where = ""
    if found.size:
        row, column = np.unravel_index(int(np.nanargmax(np.abs(grid.value))), grid.value.shape)
        where = (
            f" Largest {grid.value[row, column]:.3g} near {grid.voltage[row : row + 2].mean():.3g} and "
            f"{grid.time[column : column + 2].mean():.3g}."
        )
    alt = f"Map of {value} over {x} (across) and {y} (up).{where}{marked}"

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        bounds = np.linspace(-top, top, len(STEPS) + 1)
        norm = BoundaryNorm(bounds, len(STEPS))
        cells = np.ma.masked_invalid(grid.value)
        drawn = axes.pcolormesh(grid.time, grid.voltage, cells, cmap=ListedColormap(list(STEPS)), norm=norm)
        _signs(axes, grid, bounds)
        if region is not None:
            _outline(axes, grid, region)
        labels(axes, f"{x} (blank: not measured)" + (f"\noutlined: {region.label}" if region else ""), y)
        axes.grid(visible=False)
        axes.set_xlim(grid.time[0], grid.time[-1])
        axes.set_ylim(grid.voltage[0], grid.voltage[-1])
        scale = figure.colorbar(drawn, ax=axes, orientation="horizontal", location="top", aspect=40, pad=0.02)
        ticks = [bounds[0], bounds[2], 0.0, bounds[-3], bounds[-1]]
        scale.set_ticks(ticks)
        scale.ax.set_xticklabels([f"{tick:.2g}".replace("-", "−") for tick in ticks])
        scale.set_label(f"{value}; + and − mark the strongest")

    return Plot(draw, alt, (NARROW[0], 4.2), (9.0, 4.4))


def _signs(axes: Axes, grid: Grid, bounds: Floats) -> None:
    """`+` or a minus in every cell of the two outer colours on each side, so that colour is not needed."""
    x, y = (0.5 * (edges[1:] + edges[:-1]) for edges in (grid.time, grid.voltage))
    for sign, marker in ((1, "+"), (-1, "_")):
        row, column = np.nonzero(sign * np.nan_to_num(grid.value) > bounds[-3])
        axes.plot(x[column], y[row], marker, color=PAPER, markersize=6, markeredgewidth=1.4, zorder=2.6)


def _outline(axes: Axes, grid: Grid, region: Region) -> None:
    t = region.time or (float(grid.time[0]), float(grid.time[-1]))
    V = region.voltage or (float(grid.voltage[0]), float(grid.voltage[-1]))
    for colour, width, dash in ((PAPER, 4.0, (1.0, 0.0)), (INK, 2.0, (4.0, 2.0))):
        box = Rectangle((t[0], V[0]), t[1] - t[0], V[1] - V[0], fill=False, edgecolor=colour, linewidth=width)
        box.set_linestyle((0.0, dash))
        box.set_clip_on(False)
        axes.add_patch(box)


def signature(measured: Group, model: Curve, x: str, y: str, rival: Curve | None = None) -> Plot:
    """What the model leaves out, as measured (with 95 % intervals), against what the named physics would leave."""
    other = f", and of its rival {rival.label}" if rival is not None else ""
    alt = f"{y} over {x}: measured in {measured.x.size} places, and the signature of {model.label}{other}."

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.axhline(0.0, color=MUTED, linewidth=0.8)
        draw_curve(axes, model)
        if rival is not None:
            axes.plot(rival.x, rival.y, "--", color=MUTED, label=rival.label)
        draw_groups(axes, [measured])
        labels(axes, x, y)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.6))


@dataclass(frozen=True, eq=False)
class Panel:
    """One run (n,): time in s, measured, predicted before and after."""

    title: str
    time: Floats
    measured: Floats
    before: Floats
    after: Floats


def before_after(panel: Panel, y: str, x: str = "time / s") -> Plot:
    """Prediction over the measurement above, what is left below; before and after the physics was added."""
    rms = [float(np.sqrt(np.mean((panel.measured - p) ** 2))) for p in (panel.before, panel.after)]
    alt = f"{panel.title}: {y} measured and predicted; RMSE {rms[0]:.3g} before and {rms[1]:.3g} after."
    lines = (("before", panel.before, MUTED, "--"), ("after", panel.after, MODEL, "-"))

    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        above.plot(*drawable(panel.time, panel.measured), color=DATA, linewidth=2.4, label="measured")
        for i, (name, predicted, colour, dash) in enumerate(lines):
            above.plot(*drawable(panel.time, predicted), dash, color=colour, linewidth=1.2, label=name)
            left = panel.measured - predicted
            below.plot(
                *drawable(panel.time, left), dash, color=colour, linewidth=1.0, label=f"{name}: RMSE {rms[i]:.3g}"
            )
        labels(above, "", y)
        labels(below, x, "residual")
        legend_above(above)
        legend_above(below)
        for axes in (above, below):
            axes.margins(x=0.01)

    return Plot(draw, alt, (NARROW[0], 4.6), (9.0, 4.6))


def spectrum(power: Sequence[Group], x: str, y: str) -> Plot:
    """Power over frequency on two logarithmic scales; a line for each of at most three groups."""
    span = f"{min(g.x.min() for g in power):.3g} to {max(g.x.max() for g in power):.3g}"
    alt = f"{y} over {x}, from {span}: {', '.join(g.label for g in power)}."
    dashes = ((MUTED, "--"), (MODEL, "-"), (DATA, ":"))

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for group, (colour, dash) in zip(power, dashes[-len(power) :], strict=True):
            axes.plot(group.x, group.y, dash, color=colour, linewidth=1.3, label=group.label)
        axes.set_xscale("log")
        axes.set_yscale("log")
        labels(axes, x, y)
        legend_above(axes)

    return Plot(draw, alt)
