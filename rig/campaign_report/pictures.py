"""The picture that only a campaign's page has: the tare in the course of its runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from identification.estimation.tails import student_quantile
from identification.recording import Floats
from identification.thruster.thrust import ThrustFit
from rig.report.page import Picture
from rig.report.style import MODEL, MUTED, NARROW, SERIES, Plot, labels, legend_above


@dataclass(frozen=True, eq=False)
class Tares:
    """The cell's reading at rest in one recording: s since it began, N, half width of 95 %, (n,)."""

    time: Floats
    value: Floats
    half: Floats
    std_error: Floats

    @property
    def drift(self) -> tuple[float, float]:
        """From the first to the last, and its standard uncertainty, N."""
        return float(self.value[-1] - self.value[0]), float(np.hypot(self.std_error[0], self.std_error[-1]))


def tares(fit: ThrustFit) -> tuple[Tares, ...]:
    """Of each recording of the fit that has two tares or more."""
    out = []
    for run in fit.runs:
        found = [p.thrust for p in run.points.points if p.phase == "tare"] if run.points is not None else []
        if len(found) < 2:
            continue
        quantile = [float(student_quantile(0.975, e.dof)) if e.dof > 0 else float("nan") for e in found]
        errors = np.array([e.std_error for e in found])
        time = np.array([0.5 * (e.t_start + e.t_end) for e in found])
        out.append(Tares(time, np.array([e.mean for e in found]), np.array(quantile) * errors, errors))
    return tuple(out)


def tare_picture(fit: ThrustFit) -> tuple[Picture, ...]:
    """The tares over time beside the one that was fitted; nothing where there are not two in a recording."""
    found = tares(fit)
    if not found:
        return ()
    told = "; ".join(f"{t.value.size} tares from {t.value.min():.4g} to {t.value.max():.4g} N" for t in found)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for i, each in enumerate(found):
            colour, marker = SERIES[i % len(SERIES)]
            name = "tares" if len(found) == 1 else f"tares of recording {i + 1}"
            half = np.nan_to_num(each.half)
            axes.errorbar(each.time, each.value, half, fmt=marker, color=colour, label=name, elinewidth=1.2)
            axes.plot(each.time, each.value, ":", color=MUTED, linewidth=1.0)
        if len(fit.tare) == 1:
            (p,) = fit.tare.values()
            axes.axhline(p.value, color=MODEL, linestyle="--", linewidth=1.2, label="fitted tare")
        labels(axes, "time since the recording began / s", "thrust at rest / N")
        axes.margins(y=0.15)
        legend_above(axes)

    caption = "What the cell reads at rest. A trend is drift of the cell or of the water; bars are 95 % intervals."
    return (Picture("Tare in the course of the run", Plot(draw, f"Tare over time: {told}.", NARROW), caption),)
