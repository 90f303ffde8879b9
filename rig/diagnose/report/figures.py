"""Figures of a diagnosis beside `rig.report.mismatch_figures`: where along a coordinate, a shape, the next sweep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from identification.recording import Floats
from rig.report.regression_figures import Curve, Group, draw_curve, draw_groups
from rig.report.style import BAND, DATA, MODEL, MUTED, NARROW, OTHER, Plot, labels, legend_above

Stretch = tuple[float, float]
"""From, to: a part of the axis across."""


def plain(value: float) -> str:
    """Label of a logarithmic axis of times.

    >>> plain(0.01), plain(1.0), plain(300.0)
    ('0.01', '1', '300')
    """
    return f"{value:g}"


def _across(axes: Axes, *, spread_out: bool) -> None:
    if spread_out:
        axes.set_xscale("log")


def _named(axes: Axes, x: str, y: str, *, spread_out: bool) -> None:
    labels(axes, x, y)
    if spread_out:
        axes.xaxis.set_major_locator(LogLocator(10, (1.0,), numticks=6))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
        axes.xaxis.set_minor_formatter(NullFormatter())


def _shade(axes: Axes, stretch: Stretch | None) -> None:
    if stretch is not None:
        axes.axvspan(*stretch, color=BAND, linewidth=0, zorder=0.5, label="located here")


def residual_size(
    before: Group, after: Group, x: str, y: str, stretch: Stretch | None = None, *, spread_out: bool = False
) -> Plot:
    """RMS of what is left over a coordinate, before and after; `stretch` is shaded."""
    top = int(np.argmax(before.y))
    alt = f"{y} over {x}: largest, {before.y[top]:.3g}, near {before.x[top]:.3g}; after it is {after.y[top]:.3g} there."

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        _across(axes, spread_out=spread_out)
        _shade(axes, stretch)
        looks: tuple[dict[str, Any], ...] = (
            {"color": DATA, "marker": "o", "linestyle": "-"},
            {"color": MODEL, "marker": "s", "linestyle": "--", "markersize": 4},
        )
        for group, look in zip((before, after), looks, strict=True):
            axes.plot(group.x, group.y, label=group.label, **look)
        _named(axes, x, y, spread_out=spread_out)
        axes.set_ylim(bottom=0.0)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.5))


def shape(groups: Sequence[Group], x: str, y: str, stretch: Stretch | None = None, *, wide: bool = False) -> Plot:
    """Residuals over a coordinate with their 95 % intervals; `stretch` is shaded."""
    first = groups[0]
    top = int(np.nanargmax(np.abs(first.y)))
    alt = (
        f"{y} over {x}, {', '.join(group.label for group in groups)}, in {first.x.size} places: largest "
        f"{first.y[top]:.3g} near {first.x[top]:.3g}."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        _shade(axes, stretch)
        axes.axhline(0.0, color=MUTED, linewidth=0.8)
        draw_groups(axes, groups)
        labels(axes, x, y)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.5), (9.0, 3.4) if wide else None)


def signature_over(measured: Group, model: Curve, x: str, y: str, *, spread_out: bool = False) -> Plot:
    """What is left out, as measured (95 % intervals), and as the named physics has it in the same bins."""
    alt = (
        f"{y} over {x}: measured in {measured.x.size} places, and {model.label}; largest measured "
        f"{measured.y[np.argmax(np.abs(measured.y))]:.3g}."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        _across(axes, spread_out=spread_out)
        axes.axhline(0.0, color=MUTED, linewidth=0.8)
        axes.plot(model.x, model.y, "-s", markersize=3.5, color=MODEL, label=model.label, zorder=2.5)
        draw_groups(axes, [measured])
        _named(axes, x, y, spread_out=spread_out)
        axes.margins(y=0.1)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.6))


def spline_over(measured: Group, curve: Curve, x: str, y: str, *, spread_out: bool = False) -> Plot:
    """A flexible term with its 95 % band, beside what was measured in bins of its coordinate."""
    alt = (
        f"{y} over {x}: a spline from {curve.y.min():.3g} to {curve.y.max():.3g} with its 95 % band, and the residual "
        f"measured in {measured.x.size} bins."
    )

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        _across(axes, spread_out=spread_out)
        axes.axhline(0.0, color=MUTED, linewidth=0.8)
        draw_curve(axes, curve)
        draw_groups(axes, [measured])
        _named(axes, x, y, spread_out=spread_out)
        axes.margins(y=0.1)
        legend_above(axes)

    return Plot(draw, alt, (NARROW[0], 3.6))


def steps_plot(durations: Sequence[float], level: Sequence[float], flow: Sequence[float], name: str, unit: str) -> Plot:
    """The steps of a sweep over time, levels called `name`; the flow below where it is not at rest."""
    edges: Floats = np.concatenate([[0.0], np.cumsum(durations)])
    alt = (
        f"Sweep of {len(level)} steps in {edges[-1]:.0f} s: {name} between {min(level):.3g} and "
        f"{max(level):.3g} {unit}" + (f", flow up to {max(flow, key=abs):.3g} m/s." if any(flow) else ".")
    )

    def draw(figure: Figure) -> None:
        two = any(flow)
        axes = figure.subplots(2 if two else 1, 1, sharex=True, squeeze=False, height_ratios=[2, 1] if two else None)
        rows = [(f"{name} / {f'({unit})' if '/' in unit else unit}", level, DATA)]
        rows += [("flow / (m/s)", flow, OTHER)] if two else []
        for i, (label, values, colour) in enumerate(rows):
            axes[i, 0].axhline(0.0, color=MUTED, linewidth=0.8)
            axes[i, 0].stairs(values, edges, color=colour, baseline=None, linewidth=2.0)
            labels(axes[i, 0], "time / s" if i == len(rows) - 1 else "", label)
            axes[i, 0].margins(x=0.01, y=0.1)

    return Plot(draw, alt, (NARROW[0], 3.4), (9.0, 3.4))
