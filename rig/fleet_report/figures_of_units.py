"""The figures of a fit that are watched over a fleet, and their charts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from identification.control_charts.charts import Chart, Side, chart, limit_for
from identification.recording import Floats
from rig.fleet.question import Row

FEWEST: Final = 20
"""Units, below which limits would say more about the draw than about the thrusters."""


@dataclass(frozen=True)
class Figure:
    """One figure of a fit. `scale`: from its value to what is shown, in `unit`."""

    name: str
    title: str
    what: str
    """What a unit that left its limits has, as a clause."""
    side: Side
    unit: str
    scale: float
    of: Callable[[Row, float], tuple[float, float, float] | None]
    """(row, centre of C) -> value, its own scatter, what its calibration shares with others; None: not known."""


@dataclass(frozen=True, eq=False)
class Charted:
    """The chart of a figure. `places`: of its units among all."""

    figure: Figure
    chart: Chart
    places: Floats
    calibrations: tuple[str, ...]
    """By the numbers of `chart.shared`."""

    def shown(self, deviation: float, at: int) -> float:
        """A deviation of unit `at` of the chart, in sigma, in the unit that is shown."""
        return deviation * float(self.chart.sigma[at]) * self.figure.scale


def _constant(row: Row, centre: float) -> tuple[float, float, float] | None:
    if row["C"] is None or row["C_std_statistical"] is None:
        return None
    return row["C"] / centre, row["C_std_statistical"] / abs(centre), (row["C_std_calibration"] or 0.0) / abs(centre)


def _asymmetry(row: Row, _centre: float) -> tuple[float, float, float] | None:
    """The gain of the cell cancels in a ratio."""
    if row.get("asymmetry") is None or row["asymmetry_std"] is None:
        return None
    return row["asymmetry"], row["asymmetry_std"], 0.0


def _misfit(row: Row, _centre: float) -> tuple[float, float, float] | None:
    """By what share of the usual one: the gain of the cell and C cancel."""
    if not row.get("rmse") or not row["C"]:
        return None
    return float(np.log(row["rmse"] / abs(row["C"]))), 0.0, 0.0


def _settling(row: Row, _centre: float) -> tuple[float, float, float] | None:
    if row.get("settling_time") is None:
        return None
    return row["settling_time"], row["settling_time_std"], 0.0


FIGURES: Final = (
    Figure("C", "The thruster's constant", "C is off", "both", "% of the centre", 100.0, _constant),
    Figure("asymmetry", "C+ over C-", "forward and reverse are not as alike as usual", "both", "%", 100.0, _asymmetry),
    Figure("misfit", "What the model leaves out", "the model leaves out more or less", "both", "%", 100.0, _misfit),
    Figure("settling", "How late thrust is after a step", "thrust follows otherwise", "both", "ms", 1000.0, _settling),
)
"""`misfit`: the logarithm of the scatter about the model over C, which changes by a share."""


def charts_of(rows: Sequence[Row], sigmas: float | None = None) -> tuple[Charted, ...]:
    """Of rows in order of production the chart of each figure that FEWEST of them have. `sigmas`: limits; None: such
    that all charts of a sound fleet together show an alarm in 5 % of cases."""
    known = [row["C"] for row in rows if row["C"] is not None]
    centre = float(np.median(known)) if known else 1.0
    found = []
    for figure in FIGURES:
        each = [(k, row, figure.of(row, centre)) for k, row in enumerate(rows)]
        there = [(k, row, value) for k, row, value in each if value is not None and np.all(np.isfinite(value))]
        if len(there) >= FEWEST:
            limit = sigmas or limit_for(len(there), 2 * len(FIGURES))
            found.append(_charted(figure, there, limit))
    return tuple(found)


def _charted(figure: Figure, there: Sequence[tuple[int, Row, tuple[float, float, float]]], limit: float) -> Charted:
    value, std, stated = np.array([each for _, _, each in there]).T
    names = list(dict.fromkeys(row["calibration"] or "" for _, row, _ in there))
    group = np.array([names.index(row["calibration"] or "") for _, row, _ in there], dtype=np.float64)
    if not stated.any():
        group, names = np.zeros_like(group), [""]
    drawn = chart(value, std, group, stated, limit, figure.side)
    return Charted(figure, drawn, np.array([k for k, _, _ in there]), tuple(names))
