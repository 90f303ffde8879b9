"""Velocity from position: figures and page of the worked example of section 4.2.3, like figures 4.6 and 4.7."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from identification.recording import Floats
from identification.velocity.linear_drag import THESIS_EXAMPLE, linear_drag_response
from identification.velocity.velocity import Derivative, Window, derivative
from rig.report.page import Page, Picture, Section, Table, columns
from rig.report.style import BAND, DATA, INK, MODEL, NARROW, Plot, labels, legend_above, standalone

RATE = 3.0
"""Hz, section 4.2.3."""
SAMPLES = 540
"""180 s at 3 Hz, section 4.2.3."""
SIGMA = 0.07
"""m, standard deviation of the position noise, section 4.2.3."""
WINDOW = Window(10, 10)
ORDER = 4
SIZE = (NARROW[0], 4.4)
DESK = (9.0, 4.8)


@dataclass(frozen=True, eq=False)
class Example:
    """The worked example with one draw of the noise; (n,) each, s, m and m/s."""

    time: Floats
    position: Floats
    velocity: Floats
    noise: Floats
    found: Derivative


def example(rng: np.random.Generator) -> Example:
    """Analytic response, noise from `rng`, and the velocity that the filter of the thesis gives."""
    time: Floats = np.arange(SAMPLES) / RATE
    x, v = linear_drag_response(time, THESIS_EXAMPLE)
    noise: Floats = SIGMA * rng.standard_normal(SAMPLES)
    return Example(time, x, v, noise, derivative(time, x + noise, WINDOW, ORDER, ends="slide"))


def velocity_example(rng: np.random.Generator, folder: Path) -> tuple[Path, Path]:
    """Draw the example into SVG files in `folder`. Returns the two paths."""
    made = example(rng)
    folder.mkdir(parents=True, exist_ok=True)
    signal, estimate = folder / "velocity-signal.svg", folder / "velocity-estimate.svg"
    signal.write_text(standalone(draw_signal(made.time, made.position, made.noise), DESK), encoding="utf-8")
    estimate.write_text(standalone(draw_velocity(made.found, made.velocity, SIGMA), DESK), encoding="utf-8")
    return signal, estimate


def draw_signal(time: Floats, position: Floats, noise: Floats) -> Plot:
    """Like figure 4.6: position (m) above, the noise to be added to it (m) below; times in s."""

    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True)
        above.plot(time, position, color=INK)
        below.plot(time, noise, color=DATA, linewidth=0.7)
        labels(above, "", "position / m")
        labels(below, "time / s", "added noise / m")
        for axes in (above, below):
            axes.margins(x=0.01)

    reach = f"{position.min():.3g} to {position.max():.3g} m"
    alt = (
        f"Position of a body with linear drag over {time[-1]:.0f} s, {reach}; below, noise of {noise.std():.2g} m rms."
    )
    return Plot(draw, alt, SIZE, DESK)


def draw_velocity(found: Derivative, true: Floats | None, sigma: float | None = None) -> Plot:
    """Like figure 4.7: estimated and, where known, true velocity; below, the error with its 95 % band.

    `sigma`: standard deviation of the position noise; None: the one estimated from the residuals.
    """
    band = 1.96 * found.std(sigma)
    steady = float(np.nanmedian(band))
    """The band away from the ends, where the window is not whole and the band wide."""

    def draw(figure: Figure) -> None:
        rows = 1 if true is None else 2
        axes = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=[2, 1][:rows])[:, 0]
        low, high = found.velocity - band, found.velocity + band
        axes[0].fill_between(found.time, low, high, color=BAND, linewidth=0, label="95 % band")
        axes[0].plot(found.time, found.velocity, color=DATA, linewidth=1.0, label="estimated")
        labels(axes[0], "", "velocity / (m/s)")
        if true is not None:
            axes[0].plot(found.time, true, color=MODEL, linewidth=1.2, linestyle="--", label="true")
            axes[1].fill_between(found.time, -band, band, color=BAND, linewidth=0)
            axes[1].plot(found.time, found.velocity - true, color=DATA, linewidth=0.8)
            labels(axes[1], "", "error / (m/s)")
            axes[1].set_ylim(-4 * steady, 4 * steady)
        axes[0].set_ylim(np.nanmin(found.velocity) - 4 * steady, np.nanmax(found.velocity) + 4 * steady)
        axes[-1].set_xlabel("time / s")
        legend_above(axes[0])
        for one in axes:
            one.margins(x=0.01)

    told = "" if true is None else f"; it is off by {float(np.nanstd(found.velocity - true)):.2g} m/s rms"
    return Plot(draw, f"Velocity by a Savitzky–Golay filter with its 95 % band{told}.", SIZE, DESK)


def velocity_page(rng: np.random.Generator) -> Page:
    """The worked example as a page: what was asked of the filter, what it did, both figures."""
    made = example(rng)
    error = made.found.velocity - made.velocity
    rms = float(np.sqrt(np.mean(error**2)))
    predicted = float(np.sqrt(np.mean(made.found.std(SIGMA) ** 2)))
    inside = float(np.mean(np.abs(error) <= 1.96 * made.found.std(SIGMA)))
    lead = (
        f"The filter's velocity is off by {rms:.4f} m/s rms, where the noise it passes on predicts {predicted:.4f}; "
        f"{100 * inside:.1f} % of the samples lie in the 95 % band."
    )
    e = THESIS_EXAMPLE
    head = ("what", "value", "unit")
    rows = (
        ("mean force f0", f"{e.f0:g}", "N"),
        ("amplitude of the force Δf", f"{e.delta_f:g}", "N"),
        ("angular frequency ω", f"{e.omega:g}", "rad/s"),
        ("inertia m", f"{e.m:g}", "kg"),
        ("linear drag k", f"{e.k_l:g}", "N·s/m"),
        ("rate", f"{RATE:g}", "Hz"),
        ("samples", f"{SAMPLES}", ""),
        ("standard deviation of the position noise", f"{SIGMA:g}", "m"),
        ("window, samples left and right", f"{WINDOW.n_l} and {WINDOW.n_r}", ""),
        ("order", f"{ORDER}", ""),
    )
    signal = draw_signal(made.time, made.position, made.noise)
    estimate = draw_velocity(made.found, made.velocity, SIGMA)
    parts = (
        Table("The example of section 4.2.3", head, rows, columns(head, "what", "unit")),
        Picture("The signal, like figure 4.6", signal, "The body is pushed by a mean force and a sine."),
        Picture("The velocity, like figure 4.7", estimate, "The band is what the noise of the position makes of it."),
    )
    return Page("Velocity by a Savitzky–Golay filter", lead, (Section("Worked example", parts),))
