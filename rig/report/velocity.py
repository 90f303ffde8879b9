"""Figures of velocity estimation: the worked example of section 4.2.3, like figures 4.6 and 4.7 of the thesis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from identification.linear_drag import THESIS_EXAMPLE, linear_drag_response
from identification.recording import Floats
from identification.velocity import Derivative, Window, derivative

RATE = 3.0
"""Hz, section 4.2.3."""
SAMPLES = 540
"""180 s at 3 Hz, section 4.2.3."""
SIGMA = 0.07
"""m, standard deviation of the position noise, section 4.2.3."""
WINDOW = Window(10, 10)
ORDER = 4
INK, ESTIMATE, BAND = "#222222", "#c1440e", "#e9a23b"


def velocity_example(rng: np.random.Generator, folder: Path, suffix: str = "svg") -> tuple[Path, Path]:
    """Draw the example with noise from `rng` into `folder`; `suffix`: svg, png or pdf. Returns the two paths."""
    time: Floats = np.arange(SAMPLES) / RATE
    x, v = linear_drag_response(time, THESIS_EXAMPLE)
    noise: Floats = SIGMA * rng.standard_normal(SAMPLES)
    found = derivative(time, x + noise, WINDOW, ORDER, ends="slide")
    signal, estimate = folder / f"velocity-signal.{suffix}", folder / f"velocity-estimate.{suffix}"
    _save(draw_signal(time, x, noise), signal)
    _save(draw_velocity(found, v, SIGMA), estimate)
    return signal, estimate


def draw_signal(time: Floats, position: Floats, noise: Floats) -> Figure:
    """Like figure 4.6: position (m) above, the noise to be added to it (m) below; times in s."""
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(time, position, color=INK, linewidth=1.4)
    above.set_ylabel("position x / m")
    below.plot(time, noise, color=INK, linewidth=0.6)
    below.set_ylabel("added noise / m")
    below.set_xlabel("time / s")
    for axes in (above, below):
        _plain(axes)
    figure.suptitle("Position of a body with linear drag, and its noise", fontsize=11)
    return figure


def draw_velocity(found: Derivative, true: Floats | None, sigma: float | None = None) -> Figure:
    """Like figure 4.7: estimated and, where known, true velocity; below, the error with its 95 % band.

    `sigma`: standard deviation of the position noise; None: the one estimated from the residuals.
    """
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    rows = 1 if true is None else 2
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=[2, 1][:rows])[:, 0]
    band = 1.96 * found.std(sigma)
    axes[0].fill_between(
        found.time, found.velocity - band, found.velocity + band, color=BAND, alpha=0.4, linewidth=0, label="95 % band"
    )
    axes[0].plot(found.time, found.velocity, color=ESTIMATE, linewidth=1.0, label="estimated")
    if true is not None:
        axes[0].plot(found.time, true, color=INK, linewidth=1.2, linestyle="--", label="true")
        axes[1].fill_between(found.time, -band, band, color=BAND, alpha=0.4, linewidth=0)
        axes[1].plot(found.time, found.velocity - true, color=ESTIMATE, linewidth=0.8)
        axes[1].set_ylabel("error / (m/s)")
    axes[0].set_ylabel("velocity / (m/s)")
    axes[0].legend(loc="lower right", frameon=False, ncols=3)
    axes[-1].set_xlabel("time / s")
    for one in axes:
        _plain(one)
    figure.suptitle("Velocity by a Savitzky–Golay filter", fontsize=11)
    return figure


def _plain(axes: Axes) -> None:
    axes.grid(visible=True, color="#dddddd", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.margins(x=0.01)


def _save(figure: Figure, path: Path) -> None:
    FigureCanvasAgg(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120, metadata={"Date": None} if path.suffix == ".svg" else None)
