"""Beside the running fit: whether the run fits so far, and where it does not; in one or two lines. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from rig.console.view_model.running_fit import RunningFit, in_words, running_fit, usable, v_abs_v
from rig.console.view_model.view import View
from rig.link.front_end_messages import Point, Watching


@dataclass(frozen=True, slots=True)
class Standing:
    """What is said now, the most urgent line first."""

    lines: tuple[str, ...]
    fits: bool
    """False: something does not, and it is said in words too."""


def standing(view: View, width: int) -> Standing | None:
    """Lines of at most some `width` cells; None while nothing was measured and nothing is watched."""
    snapshot = view.snapshot
    if snapshot is None or (not snapshot.points and snapshot.watch.state in ("off", "learning")):
        return None
    fit = running_fit(tuple(snapshot.points))
    watch = snapshot.watch
    if watch.state == "mismatch":
        return Standing(
            (mismatch_line(watch, width), _beside(short_fit(fit), watch.brief, watch.advice, width)), fits=False
        )
    if fit is not None and fit.misfit is not None:
        said = _beside(in_words(fit), "rig diagnose", "rig diagnose, by g once the campaign has ended", width, "next: ")
        return Standing((misfit_line(fit, snapshot.points), said), fits=False)
    return Standing((f"{in_words(fit)}{':' if fit is not None else ';'} {_so_far(watch)}",), fits=True)


def _so_far(watch: Watching) -> str:
    match watch.state:
        case "fits":
            return "fits so far"
        case "learning":
            return "too early to say"
        case "failed":
            return f"not watched: {watch.text}"
        case _:
            return "not watched"


def mismatch_line(watch: Watching, width: int) -> str:
    """From which step on, at which levels, how much, since when and how sure; where `width` is small not in newtons
    too."""
    begin = "DOES NOT FIT" + (f" from step {watch.step + 1}" if watch.step is not None else "")
    at = f", {volts(watch.low, watch.high)}" if watch.low is not None and watch.high is not None else ""
    since = "from the start" if watch.from_start else f"since {watch.began:.0f} s"
    since = f"{since}, {watch.sigma:.2g} sigma"
    full = f"{begin}{at}: {watch.text} {since}"
    return full if len(full) <= width else f"{begin}{at}: {watch.text.partition(' (')[0]} {since}"


def misfit_line(fit: RunningFit, points: tuple[Point, ...]) -> str:
    """Where the square law leaves most, in standard errors of that point."""
    worst = max((point for point in points if usable(point)), key=lambda point: abs(_sigmas(fit, point)))
    left = worst.thrust - fit.predict(v_abs_v(worst))
    predicted = fit.predict(v_abs_v(worst))
    size = f"{100.0 * left / abs(predicted):+.2g} % ({left:+.2g} N)" if predicted else f"{left:+.2g} N"
    where = f"step {worst.step + 1}, {worst.voltage:+.3g} V"
    return f"C V|V| DOES NOT FIT, most at {where}: thrust {size}, {abs(_sigmas(fit, worst)):.2g} sigma"


def _sigmas(fit: RunningFit, point: Point) -> float:
    return (point.thrust - fit.predict(v_abs_v(point))) / point.std_error


def volts(low: float, high: float) -> str:
    """`+3 … +5 V`, or `+4 V` for one level alone."""
    return f"{low:+.3g} V" if low == high else f"{low:+.3g} … {high:+.3g} V"


def short_fit(fit: RunningFit | None) -> str:
    """The fit where something else needs the room too."""
    return in_words(fit).replace("(k = 2, ", "(") if fit is not None else "no fit yet"


def _beside(fit: str, brief: str, advice: str, width: int, lead: str = "") -> str:
    """The fit and what to do, in more words where there is room."""
    long = f"{fit}; {lead}{advice}"
    return long if len(long) <= width else f"{fit}; {lead}{brief}"
