"""The one look of all figures: colours, sizes, and SVG that follows the page from light to dark.

Colours are drawn by name. In the SVG each becomes `var(--name, #light)`: inside a page the page's style sheet decides,
alone in a file the light value holds. Series differ by marker or dash as well as by colour. The pairs of colours are
blue and vermilion of Okabe and Ito's set (jfly.uni-koeln.de/color), darkened for text contrast on white.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.style import context
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from identification.recording import Floats


class Colour(NamedTuple):
    """A role and what it looks like on white and on dark paper."""

    name: str
    light: str
    dark: str


INK: Final = "#1c2128"
MUTED: Final = "#56606b"
GRID: Final = "#dde2e7"
PAPER: Final = "#fefefe"
DATA: Final = "#0b62a4"
MODEL: Final = "#c2500a"
BAND: Final = "#f7dcc6"
OTHER: Final = "#00795d"
THIRD: Final = "#83408f"
STEPS: Final = ("#0b4a87", "#3b7ab3", "#86b0d5", "#cfdfed", "#e4e7ea", "#f6dcc4", "#eaac76", "#cd742a", "#8d4209")
"""Diverging: most negative first, nothing in the middle."""
PALETTE: Final = (
    Colour("ink", INK, "#e6e9ed"),
    Colour("muted", MUTED, "#a3adb8"),
    Colour("grid", GRID, "#333b44"),
    Colour("paper", PAPER, "#14181d"),
    Colour("data", DATA, "#66b5f0"),
    Colour("model", MODEL, "#f59a5b"),
    Colour("band", BAND, "#4d3423"),
    Colour("other", OTHER, "#3fc79d"),
    Colour("third", THIRD, "#d59be0"),
    *(
        Colour(f"step{i}", light, dark)
        for i, (light, dark) in enumerate(
            zip(
                STEPS,
                ("#9fd0ff", "#5fa3dd", "#3b719f", "#29485f", "#2c333b", "#584029", "#96602f", "#d9873c", "#ffc48f"),
                strict=True,
            )
        )
    ),
)
SERIES: Final = ((DATA, "o"), (OTHER, "s"), (THIRD, "^"), (MUTED, "D"))
"""Colour and marker of the first, second ... group of points."""

NARROW: Final = (4.5, 3.3)
"""inches; at 360 CSS pixels a point is 1.11 pixels, so 10.2 pt are 11 px: readable on a phone."""
WIDE: Final = (9.0, 3.6)
"""inches, across both columns of a desk page."""
TEXT: Final = 10.2
"""pt, every letter in every figure."""
LETTERS: Final = 12.5
"""of that size to an inch."""

STYLE: Final[dict[str, Any]] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "thruster-rig",
    "text.parse_math": False,
    "font.size": TEXT,
    "font.family": "DejaVu Sans",
    "axes.titlesize": TEXT,
    "axes.labelsize": TEXT,
    "xtick.labelsize": TEXT,
    "ytick.labelsize": TEXT,
    "legend.fontsize": TEXT,
    "legend.frameon": False,
    "legend.handlelength": 1.6,
    "legend.borderaxespad": 0.2,
    "text.color": INK,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.facecolor": "none",
    "axes.titlelocation": "left",
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    "axes.formatter.limits": (-4, 5),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "lines.linewidth": 1.6,
    "lines.markersize": 5.0,
    "errorbar.capsize": 2.5,
    "path.simplify": False,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "legend.labelcolor": INK,
}


@dataclass(frozen=True)
class Plot:
    """A drawing that can be made at more than one size."""

    draw: Callable[[Figure], None]
    alt: str
    """What a person who does not see it should know."""
    size: tuple[float, float] = NARROW
    wide: tuple[float, float] | None = None
    """A second size, for a desk, when it gains by it."""


def svg(plot: Plot, size: tuple[float, float] | None = None) -> str:
    """An `<svg>` element without dates or addresses: the same plot gives the same text."""
    with context(STYLE):
        figure = Figure(figsize=size or plot.size, layout="constrained")
        plot.draw(figure)
        for axes in figure.axes:
            for artist in (*axes.lines, *axes.collections, *axes.patches):
                artist.set_in_layout(False)  # inside the axes anyway: no need to measure it
        sink = StringIO()
        metadata = {"Date": None, "Creator": None, "Format": None, "Type": None}
        figure.savefig(sink, format="svg", metadata=metadata)
    return _clean(sink.getvalue())


def standalone(plot: Plot, size: tuple[float, float] | None = None) -> str:
    """The same as a file of its own."""
    names = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" font-family="sans-serif"'
    body = svg(plot, size).replace("<svg", f"<svg {names}", 1).replace(' href="#', ' xlink:href="#')
    paper = f'<rect width="100%" height="100%" style="fill: {PAPER}"/>'
    return '<?xml version="1.0" encoding="utf-8"?>\n' + re.sub(r"(<svg[^>]*>)", rf"\1{paper}", body, count=1)


def _clean(text: str) -> str:
    """Without prologue, name spaces, metadata, ids that nothing refers to; colours by name."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'<style type="text/css">.*?</style>', "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"(<svg[^>]*>)", _opening, text, count=1)
    text = text.replace("xlink:href=", "href=")
    used = set(re.findall(r'href="#([^"]+)"', text)) | set(re.findall(r"url\(#([^)]+)\)", text))
    text = re.sub(r' id="([^"]+)"', lambda m: m[0] if m[1] in used else "", text)
    for name, light, _ in PALETTE:
        text = text.replace(f": {light}", f": var(--{name}, {light})")
    text = text.replace("font-family: 'DejaVu Sans'; ", "")
    text = re.sub(r"<[^>]*>", lambda tag: re.sub(r"(\d\.\d\d)\d+(?![\de])", r"\1", tag[0]), text)
    return re.sub(r"\n\s*\n+", "\n", text).strip()


def _opening(found: re.Match[str]) -> str:
    box = re.search(r'viewBox="[^"]*"', found[0])
    assert box is not None
    return f"<svg {box[0]}>"


def dots(axes: Axes, x: Floats, y: Floats, colour: str, size: float, label: str | None = None) -> None:
    """Many small round points as one path of strokes without length: a tenth of the bytes of as many markers."""
    gaps = np.full(x.size, np.nan)
    across, up = (np.column_stack([z, z, gaps]).ravel() for z in (x, y))
    axes.plot(across, up, color=colour, linewidth=size, solid_capstyle="round")
    axes.plot([], [], "o", color=colour, markersize=max(size, 3.0), label=label)


def drawable(x: Floats, y: Floats, most: int = 1200) -> tuple[Floats, Floats]:
    """A long line (n,) as at most about `most` points that keep its lowest and highest in each stretch.

    >>> x, y = drawable(np.arange(6.0), np.array([0.0, 9.0, 1.0, 2.0, -5.0, 3.0]), 4)
    >>> x.tolist(), y.tolist()
    ([0.0, 1.0, 4.0, 5.0], [0.0, 9.0, -5.0, 3.0])
    """
    if x.size <= most:
        return x, y
    edges = np.linspace(0, x.size, max(most // 2, 1) + 1).astype(np.intp)
    kept = [a + part for a, b in pairwise(edges) if b > a for part in (y[a:b].argmin(), y[a:b].argmax())]
    at = np.unique(kept)
    return x[at], y[at]


def unit_text(unit: str) -> str:
    """A unit as people write it.

    >>> unit_text("N/V^2"), unit_text("N.m/(rad/s)^2"), unit_text("1")
    ('N/V²', 'N·m/(rad/s)²', '')
    """
    return "" if unit == "1" else unit.replace("^2", "²").replace(".", "·")


def prose(text: str) -> str:
    """A sentence of the identification as people write it.

    >>> prose("C_plus = 0.4 N/V^2, C_t_minus is lost")
    'C+ = 0.4 N/V², C_t− is lost'
    >>> prose("thrust grows as |V|^2.19, not as V^2.")
    'thrust grows as |V|^2.19, not as V².'
    """
    return re.sub(r"\^2(?!\.?\d)", "²", text).replace("_plus", "+").replace("_minus", "−")


def power_of_ten(value: float) -> str:
    """Label of a logarithmic axis, without mathematics mode.

    >>> power_of_ten(1000.0), power_of_ten(1.0), power_of_ten(1e-05)
    ('10³', '1', '10⁻⁵')
    """
    exponent = round(math.log10(value))
    return "1" if exponent == 0 else "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def labels(axes: Axes, x: str, y: str) -> None:
    """Axis labels and few enough ticks for a phone."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "linear":
            axis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))
        else:
            axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
            axis.set_minor_formatter(NullFormatter())


def legend_above(axes: Axes) -> None:
    """Outside the axes, where it hides no point, in as many columns as fit; nothing for fewer than two series."""
    handles, names = axes.get_legend_handles_labels()
    if len(handles) < 2:
        return
    room = LETTERS * axes.get_window_extent().width / axes.figure.dpi
    columns = next((n for n in range(len(names), 1, -1) if _width(names, n) <= room), 1)
    axes.legend(handles, names, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, columnspacing=1.0)


def _width(names: Sequence[str], columns: int) -> int:
    """Letters that a legend in so many columns, filled from the top, takes; a marker is worth 4."""
    rows = -(-len(names) // columns)
    return sum(4 + max(map(len, names[i : i + rows])) for i in range(0, len(names), rows))
