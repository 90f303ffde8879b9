"""One figure as a file: the same bytes for the same plot, whatever the day and the machine's clock."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure
from matplotlib.style import context

from rig.errors import ConfigError
from rig.report.style import PAPER, STYLE, Plot, standalone

DOTS: Final = 200
"""To an inch, of a PNG: a figure 9 in wide has 1800 of them."""
WITHOUT_DATE: Final[dict[str, dict[str, Any]]] = {
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
ENDINGS: Final = (".png", ".svg", ".pdf")


def require_ending(option: str, path: Path) -> None:
    """Raises ConfigError for a file name whose ending is no kind of picture that can be written."""
    if path.suffix.lower() not in ENDINGS:
        raise ConfigError(
            f"{option} {path}: expected a name that ends in {', '.join(ENDINGS)}, came {path.suffix or 'no ending'!r}; "
            "the ending says which kind of picture is written"
        )


def image(plot: Plot, ending: str, size: tuple[float, float] | None = None) -> bytes:
    """The picture as a file holds it. `ending`: one of `ENDINGS`; `size` in inches, that of the plot if not given."""
    if ending == ".svg":
        return standalone(plot, size).encode("utf-8")
    sink = BytesIO()
    with context(STYLE):
        figure = Figure(figsize=size or plot.size, layout="constrained")
        plot.draw(figure)
        figure.savefig(sink, format=ending[1:], dpi=DOTS, facecolor=PAPER, metadata=WITHOUT_DATE[ending])
    return sink.getvalue()
