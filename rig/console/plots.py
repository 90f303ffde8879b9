"""The curves of a sweep: thrust against V|V| with error bars and running fit, the residual, thrust against time."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from typing import Final

from textual_plotext import PlotextPlot
from textual_plotext.plot import Plot

from rig.console.titles import entitle
from rig.console.view_model import traces
from rig.console.view_model.axes import reach, ticks, to_row
from rig.console.view_model.running_fit import RunningFit, running_fit, usable, v_abs_v
from rig.console.view_model.view import View
from rig.console.view_model.wording import unit
from rig.link.front_end_messages import Point

BAR: Final = 1.96
"""Standard errors in an error bar: 95 %."""
CYAN, GREEN, AMBER, GREY = (90, 200, 250), (127, 216, 143), (240, 192, 64), (170, 170, 170)
LEFT, RIGHT = 1, 2
"""Plotext's numbers of the y axes, where its signatures ask for a number."""
Span = tuple[float, float]


class Curve(PlotextPlot):
    """A plot that is drawn again only when what it shows has changed."""

    drawn: Hashable = None
    """What the drawing on the screen was made of."""

    def redraw(self, made_of: Hashable, draw: Callable[[Plot], None]) -> None:
        """Draw, unless this is on the screen already. Hidden plots cost nothing."""
        if made_of == self.drawn or not self.size:
            return
        self.drawn = made_of
        self.plt.clear_figure()
        draw(self.plt)
        self.refresh()


class FitPlot(Curve):
    """Thrust in N against V|V| in V^2."""

    def show(self, view: View) -> None:
        points = points_of(view)
        fit = running_fit(points)
        legend = "   ● steady  ○ not steady  bars 95 %" if self.size.width >= 64 else "  ● steady ○ not"
        entitle(self, f"thrust (N) over V|V| (V²){legend}")

        def draw(plot: Plot) -> None:
            if not points:
                return
            thrust = [point.thrust for point in points]
            row = _frame(plot, points, thrust, self.size.height)
            if fit is not None:
                ends = [min(map(v_abs_v, points)), max(map(v_abs_v, points))]
                plot.plot(ends, [fit.predict(end) for end in ends], marker="braille", color=GREEN)
            _holds(plot, points, thrust, row)

        self.redraw((points, self.size), draw)


class ResidualPlot(Curve):
    """Thrust minus the running fit in N against V|V| in V^2: on this scale the error bars can be seen."""

    def show(self, view: View) -> None:
        points = points_of(view)
        fit = running_fit(points)
        entitle(self, "thrust minus fit (N) over V|V| (V²)", "a bend here is something that C V|V| leaves out")
        self.redraw((points, self.size), lambda plot: self._draw(plot, points, fit))

    def _draw(self, plot: Plot, points: tuple[Point, ...], fit: RunningFit | None) -> None:
        if fit is None:
            return
        left = [point.thrust - fit.predict(v_abs_v(point)) for point in points]
        row = _frame(plot, points, left, self.size.height)
        ends = [min(map(v_abs_v, points)), max(map(v_abs_v, points))]
        plot.plot(ends, [0.0, 0.0], marker="braille", color=GREEN)
        _holds(plot, points, left, row)


class TimePlot(Curve):
    """Two strips over the recording's time in s: the chosen channel above, the command in V below, from least to
    greatest in each column."""

    def show(self, view: View) -> None:
        since = traces.misfit_since(view)
        mark = "│ from here on it does not fit   " if since is not None else ""
        entitle(self, traces.title(view, wide=self.size.width >= 64), f"{mark}c: another channel")
        made_of = (view.trace[-1:], len(view.trace), traces.plotted(view), since, self.size)
        self.redraw(made_of, lambda plot: self._draw(plot, view))

    def _draw(self, plot: Plot, view: View) -> None:
        shown = traces.plotted(view)
        most = 2 * self.size.width
        command = traces.bands(view, traces.COMMAND, most)
        found = traces.bands(view, shown.channel, most) if shown is not None else []
        if shown is None or not found:
            return
        alone = shown.channel == traces.COMMAND or not command
        low, high = traces.span_of(found, shown.unit)
        upper = (low, high) if alone else (low - 0.6 * (high - low), high)  # the channel in the upper five eighths
        self._strip(plot, found, (low, high), upper, unit(shown.unit))
        if not alone:
            least, most_volts = traces.span_of(command, "V")
            lower = (least, most_volts + 2.2 * (most_volts - least))  # the command in the lower third
            self._strip(plot, command, (least, most_volts), lower, "V", RIGHT)
        begin, end = view.trace[0][0], max(view.trace[-1][0], view.trace[0][0] + 10.0)
        plot.xlim(begin, end)
        plot.xticks(*ticks(begin, end, 6))
        since = traces.misfit_since(view)
        if since is not None:
            plot.vline(since, color=AMBER)

    def _strip(
        self, plot: Plot, found: Sequence[traces.Band], band: Span, axis: Span, of_unit: str, side: int = LEFT
    ) -> None:
        """One channel within `band` of the axis of that side; its highest number has the unit."""
        plot.ylim(*axis, yside=side)
        _row_ticks(plot, band, axis, self.size.height, side, "" if of_unit == "1" else f" {of_unit}")
        times, values = traces.dots(found, (axis[1] - axis[0]) / max(4 * (self.size.height - 3), 4))
        right = side == RIGHT
        plot.scatter(
            times, values, marker="braille", color=AMBER if right else CYAN, yside="right" if right else "left"
        )


def points_of(view: View) -> tuple[Point, ...]:
    """The holds of the thruster on the bench, whose thrust is a number."""
    known = view.points.get(view.snapshot.thruster, ()) if view.snapshot is not None else ()
    return tuple(point for point in known if math.isfinite(point.thrust))


def _half(point: Point) -> float:
    return BAR * point.std_error if usable(point) else 0.0


def _frame(plot: Plot, points: Sequence[Point], values: Sequence[float], height: int) -> Callable[[float], float]:
    """Axes that hold every bar, with round numbers. Returns where full-cell marks go, see `to_row`."""
    x = reach([v_abs_v(point) for point in points], least=10.0)
    edges = [value + sign * _half(p) for p, value in zip(points, values, strict=True) for sign in (-1, 1)]
    low, high = reach(edges, least=0.1)
    plot.xlim(*x)
    plot.ylim(low, high)
    plot.xticks(*ticks(*x, 6))
    return _row_ticks(plot, (low, high), (low, high), height)


def _row_ticks(
    plot: Plot, band: Span, axis: Span, height: int, side: int = LEFT, of_unit: str = ""
) -> Callable[[float], float]:
    """Round numbers within `band` of an axis, on the rows where the curve is. Frame and x ticks take three rows."""
    rows = height - 3
    places, labels = ticks(*band, max(4, round(rows / 2 * (band[1] - band[0]) / (axis[1] - axis[0]))))
    labels[-1:] = [f"{label}{of_unit}" for label in labels[-1:]]
    plot.yticks([to_row(place, *axis, rows) for place in places], labels, yside=side)
    return lambda value: to_row(value, *axis, rows)


def _holds(plot: Plot, points: Sequence[Point], values: Sequence[float], row: Callable[[float], float]) -> None:
    """Points at `values` in N with their error bars."""
    for point, value in zip(points, values, strict=True):
        plot.plot([v_abs_v(point)] * 2, [value - _half(point), value + _half(point)], marker="braille", color=GREY)
    for steady, marker in ((True, "●"), (False, "○")):
        chosen = [(v_abs_v(p), row(value)) for p, value in zip(points, values, strict=True) if p.steady is steady]
        if chosen:
            plot.scatter([x for x, _ in chosen], [y for _, y in chosen], marker=marker, color=CYAN)
