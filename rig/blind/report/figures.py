"""Figures of the blind proof: rates with their intervals, who was taken for whom, outcomes, power, errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from scipy.stats import norm

from identification.recording import Floats
from rig.blind.scoring.rates import Rate
from rig.report.style import DATA, GRID, INK, MODEL, MUTED, NARROW, OTHER, THIRD, Plot, labels, legend_above

ROW = 0.27
"""inches of one row of names."""
APART = 0.28
"""of the distance of two names: the series of one."""
LEAST = 2.6
"""inches: legend, axis and a row or two."""
DESK = 8.0
"""inches of width from which names fit on both axes of a matrix."""
LOOKS = ((MUTED, "v"), (OTHER, "s"), (DATA, "o"), (THIRD, "^"))
OUTCOMES = (DATA, THIRD, MUTED, MODEL, GRID, INK)
"""In the order of the outcomes: good, good but for a name, in between, bad, nothing, failed."""
OTHERS = (THIRD, MUTED, GRID, INK)
"""Answers that are no name: among rivals, unexplained, adequate, failed."""


@dataclass(frozen=True, slots=True)
class Row:
    """A name, and a rate for each of the series."""

    name: str
    rates: tuple[Rate, ...]


def rates(rows: Sequence[Row], series: Sequence[str], x: str, goal: float | None = None) -> Plot:
    """Rates with Wilson's intervals, one name below the other, the series a little apart; `goal` a dashed line."""
    told = "; ".join(f"{row.name} " + " ".join(f"{100 * r.value:.0f} %" for r in row.rates if r.n) for row in rows)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        if goal is not None:
            axes.axvline(100 * goal, color=MUTED, linestyle="--", linewidth=1.2)
        for j, (name, (colour, marker)) in enumerate(zip(series, LOOKS, strict=False)):
            shift = (j - (len(series) - 1) / 2) * APART
            seen = [(i + shift, row.rates[j]) for i, row in enumerate(rows) if row.rates[j].n]
            for y, r in seen:
                axes.plot([100 * r.low, 100 * r.high], [y, y], color=colour, linewidth=1.2)
            at, values = [y for y, _ in seen], [100 * r.value for _, r in seen]
            axes.plot(values, at, marker, color=colour, linestyle="none", markersize=4.5, label=name)
        labels(axes, x, "")
        _names(axes, [row.name for row in rows])
        _legend(figure, axes)

    height = max(1.2 + max(ROW, 0.14 * len(series)) * len(rows), LEAST)
    return Plot(draw, f"{x}: {told}.", (NARROW[0], height), (9.0, height))


def _names(axes: Axes, names: Sequence[str]) -> None:
    axes.set_yticks(range(len(names)), list(names))
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")


def _legend(figure: Figure, axes: Axes) -> None:
    """From the left edge of the figure: beside long names the axes are too narrow for it."""
    handles, names = axes.get_legend_handles_labels()
    if len(names) > 1:
        columns = len(names) if figure.get_figwidth() >= DESK else 2
        figure.legend(handles, names, loc="outside upper left", ncols=columns, columnspacing=1.0)


def taken_for(counts: Mapping[str, Mapping[str, int]], others: Sequence[str]) -> Plot:
    """Truth x answer. On a desk the whole matrix; on a phone how many were right, taken for another, not named."""
    effects = list(counts)
    answers = [*effects, *(n for n in _answers(counts) if n not in effects and n not in others), *others]
    total = {truth: sum(row.values()) for truth, row in counts.items()}

    def whole(axes: Axes) -> None:
        share = np.array([[counts[t].get(a, 0) / total[t] for a in answers] for t in effects])
        for (i, j), value in np.ndenumerate(share):
            if value > 0:
                good = DATA if answers[j] == effects[i] else MODEL
                colour = dict(zip(others, OTHERS, strict=True)).get(answers[j], good)
                axes.plot(j, i, "s", color=colour, markersize=3.0 + 9.0 * float(np.sqrt(value)))
        axes.set_xticks(range(len(answers)), answers, rotation=90)
        axes.set_xlim(-0.7, len(answers) - 0.3)
        axes.axvline(len(answers) - len(others) - 0.5, color=MUTED, linewidth=1.0)
        _names(axes, effects)

    def short(figure: Figure, axes: Axes) -> None:
        parts = {"right": DATA, "another name": MODEL, **dict(zip(others, OTHERS, strict=True))}
        left = np.zeros(len(effects))
        for part, colour in parts.items():
            n = np.array([_part(counts[t], t, part, others) / total[t] for t in effects])
            axes.barh(range(len(effects)), 100 * n, left=100 * left, color=colour, label=part, height=0.7)
            left += n
        labels(axes, "share of the answers / %", "")
        _names(axes, effects)
        _legend(figure, axes)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        if figure.get_figwidth() >= DESK:
            whole(axes)
        else:
            short(figure, axes)

    height = max(1.2 + ROW * len(effects), LEAST)
    says = f"What was concealed and what was answered: {_wrongly(counts, total)}."
    return Plot(draw, says, (NARROW[0], height), (9.0, height + 1.9))


def _wrongly(counts: Mapping[str, Mapping[str, int]], total: Mapping[str, int]) -> str:
    """In words, for who cannot see the figure: every wrong answer, the most frequent first."""
    wrong = {t: sorted(((n, a) for a, n in row.items() if a != t), reverse=True) for t, row in counts.items()}
    told = "; ".join(f"{t}: " + ", ".join(f"{a} {n} of {total[t]}" for n, a in w) for t, w in wrong.items() if w)
    return told or "every answer names what was concealed"


def _answers(counts: Mapping[str, Mapping[str, int]]) -> list[str]:
    return sorted({a for row in counts.values() for a in row})


def _part(row: Mapping[str, int], truth: str, part: str, others: Sequence[str]) -> int:
    if part == "right":
        return row.get(truth, 0)
    if part in others:
        return row.get(part, 0)
    return sum(n for a, n in row.items() if a != truth and a not in others)


def outcomes(rows: Sequence[tuple[str, Mapping[str, int]]], names: Sequence[str]) -> Plot:
    """Shares of the outcomes `names` for each row, one bar each; its count at the end."""
    told = "; ".join(f"{row} " + ", ".join(f"{k} {v}" for k, v in counts.items()) for row, counts in rows)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        left = np.zeros(len(rows))
        total = np.array([max(sum(counts.values()), 1) for _, counts in rows])
        for name, colour in zip(names, OUTCOMES, strict=True):
            n = np.array([counts.get(name, 0) for _, counts in rows]) / total
            axes.barh(range(len(rows)), 100 * n, left=100 * left, color=colour, label=name, height=0.7)
            left += n
        labels(axes, "share of the runs that can be told / %", "")
        _names(axes, [row for row, _ in rows])
        _legend(figure, axes)

    height = max(1.2 + ROW * len(rows), LEAST)
    return Plot(draw, f"Outcomes in the open world: {told}.", (NARROW[0], height), (9.0, height))


def power(measured: Mapping[float, Rate], oracle: float) -> Plot:
    """Share of runs in which the effect is named over its strength, beside an oracle that knows the effect."""
    told = ", ".join(f"{100 * r.value:.0f} % at {d:.3g} sigma" for d, r in measured.items())

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        d = np.geomspace(1.0, 60.0, 200)
        axes.plot(d, 100 * norm.cdf(d - oracle), "--", color=MUTED, label="oracle at 1 % false alarms")
        at = np.array(list(measured))
        values = np.array([100 * r.value for r in measured.values()])
        for x, r in measured.items():
            axes.plot([x, x], [100 * r.low, 100 * r.high], color=DATA, linewidth=1.2)
        axes.plot(at, values, "o-", color=DATA, label="named by rig diagnose")
        axes.set_xscale("log")
        labels(axes, "strength d' / sigma", "named / %")
        axes.xaxis.set_major_locator(FixedLocator([1, 2, 5, 10, 20, 40]))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        legend_above(axes)

    return Plot(draw, f"All effects together: named in {told}.", NARROW)


def distribution(model: Floats, baseline: Floats, limits: Sequence[float]) -> Plot:
    """Share of the runs below a held-out error, relative to that of the true model; `limits`: the goals."""

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for limit in limits:
            axes.axvline(limit, color=MUTED, linestyle="--", linewidth=1.2)
        for values, colour, dash, name in (
            (baseline, MODEL, "-", "baseline"),
            (model, DATA, "-", "model found"),
        ):
            x = np.sort(values)
            axes.step(x, 100 * np.arange(1, x.size + 1) / x.size, dash, where="post", color=colour, label=name)
        axes.set_xlim(0.97, max(1.4, min(float(np.quantile(baseline, 0.9)), 3.0)))
        labels(axes, "error / error of the true model", "runs below / %")
        legend_above(axes)

    told = " and ".join(f"{np.median(v):.3f} ({name})" for v, name in ((model, "model found"), (baseline, "baseline")))
    return Plot(draw, f"Held-out error relative to that of the true model, median {told}.", NARROW)
