"""A control chart as a picture: every unit with the limits, and below it the weighted mean."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from identification.recording import Floats
from rig.fleet.question import Row
from rig.fleet_report.figures_of_units import Charted
from rig.report.page import Picture
from rig.report.style import BAND, DATA, MODEL, MUTED, Plot, dots, drawable, labels, legend_above

SIZE, DESK = (4.5, 5.0), (9.0, 5.0)
"""inches."""
VAGUE = "not outside: known no better"
"""A unit beyond the lines, which are those of the usual one; its bar is its own limits."""


def picture(charted: Charted, rows: Sequence[Row]) -> Picture:
    """Shewhart's chart over that of the weighted mean; stretches are shaded."""
    chart, figure = charted.chart, charted.figure
    x, across = _order(charted, rows)
    outside = int(np.count_nonzero(chart.outside))
    alt = (
        f"{figure.title} of {x.size} units over {across}: {outside} outside the limits of {chart.limit:.3g} standard "
        f"deviations, {len(chart.stretches)} stretches in which the weighted mean is outside its own."
    )

    def draw(drawing: Drawing) -> None:
        above, below = drawing.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for axes in (above, below):
            for stretch in chart.stretches:
                axes.axvspan(x[stretch.first], x[stretch.last], color=BAND, linewidth=0, zorder=0.5)
        _units(above, charted, x)
        _mean(below, charted, x)
        labels(above, "", _axis(charted))
        labels(below, across, "weighted mean / σ")
        legend_above(above)

    caption = (
        "Above: each unit, with Shewhart's limits. Below: the exponentially weighted mean of the deviations, in "
        "standard deviations of a unit, which shows a drift before any single unit is outside. Shaded: where that "
        "mean is off."
    )
    return Picture(figure.title, Plot(draw, alt, SIZE, DESK), caption)


def _order(charted: Charted, rows: Sequence[Row]) -> tuple[Floats, str]:
    """Serial numbers where they are all there and all different, else places."""
    serials = [rows[int(place)]["serial"] for place in charted.places]
    if all(serial is not None for serial in serials) and len(set(serials)) == len(serials):
        return np.array(serials, dtype=np.float64), "serial number"
    return np.asarray(charted.places, dtype=np.float64) + 1.0, "unit, in order of production"


def _axis(charted: Charted) -> str:
    figure = charted.figure
    return f"{figure.name} off the centre / {figure.unit.split()[0]}"


def _units(axes: Axes, charted: Charted, x: Floats) -> None:
    chart = charted.chart
    y = (chart.value - chart.centre) * charted.figure.scale
    out, own = chart.outside, chart.limit * chart.sigma * charted.figure.scale
    half = float(np.median(own))
    vague = ~out & (np.abs(y) > half if chart.side == "both" else y > half)
    axes.axhline(0.0, color=MUTED, linewidth=1.0)
    axes.axhline(half, color=MODEL, linestyle="--", linewidth=1.2, label="limits")
    if chart.side == "both":
        axes.axhline(-half, color=MODEL, linestyle="--", linewidth=1.2)
    dots(axes, x[~out], y[~out], DATA, 1.8, "a unit")
    axes.plot(x[out], y[out], "D", color=MODEL, markersize=4.5, fillstyle="none", label="outside")
    if vague.any():
        axes.errorbar(x[vague], y[vague], own[vague], fmt="o", color=DATA, markersize=3.0, linewidth=1.0, label=VAGUE)
    axes.margins(y=0.08)


def _mean(axes: Axes, charted: Charted, x: Floats) -> None:
    chart = charted.chart
    axes.axhline(0.0, color=MUTED, linewidth=1.0)
    for sign in (1.0, -1.0) if chart.side == "both" else (1.0,):
        axes.plot(*drawable(x, sign * chart.mean_limit, 200), "--", color=MODEL, linewidth=1.2)
    axes.plot(*drawable(x, chart.mean), color=DATA, linewidth=1.2)
    axes.margins(y=0.1)
