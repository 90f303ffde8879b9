"""Which recorded channel the time plot shows, and its envelope made short enough to draw. Pure."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rig.console.view_model.axes import reach
from rig.console.view_model.palette import Entry
from rig.console.view_model.view import View
from rig.console.view_model.wording import unit
from rig.link.front_end_messages import TracedChannel, TraceRow

COMMAND: Final = "command"
"""The channel of what was sent to the motor."""
LEAST_SPAN: Final = {"N": 1.0, "V": 1.0, "A": 0.5, "rev/s": 0.5, "m/s": 0.05, "degC": 0.5, "N*m": 0.1, "Pa": 200.0}
"""Smallest span of an axis: noise at rest shall not fill the plot."""
MOST_DOTS: Final = 3000
"""In one curve: a plot takes some ms per thousand."""


@dataclass(frozen=True, slots=True)
class Band:
    """Least and greatest value in a span of time around `time` in s."""

    time: float
    low: float
    high: float


def plotted(view: View) -> TracedChannel | None:
    """The channel chosen; the first thrust where none is, or where the bench does not have it."""
    channels = view.snapshot.channels if view.snapshot is not None else ()
    chosen = [one for one in channels if one.channel == view.plotted]
    thrust = [one for one in channels if one.quantity == "thrust"]
    return next(iter((*chosen, *thrust, *channels)), None)


def names(channels: Sequence[TracedChannel]) -> dict[str, str]:
    """Channel -> its last part, or the whole where two share the last part."""
    tails = Counter(one.channel.rpartition(".")[2] for one in channels)
    return {
        one.channel: tail if tails[tail := one.channel.rpartition(".")[2]] == 1 else one.channel for one in channels
    }


def channels_to_choose(view: View) -> tuple[Entry, ...]:
    """Every recorded channel by its name in the recording, with its unit."""
    channels = view.snapshot.channels if view.snapshot is not None else ()
    short = names(channels)
    return tuple(
        Entry(one.channel, short[one.channel], unit(one.unit), f"of {stream}" if stream else "sent to the motor")
        for one in channels
        for stream in (one.channel.rpartition(".")[0],)
    )


def title(view: View, *, wide: bool) -> str:
    """Over the plot: what is drawn in which unit, and how to have another channel."""
    one = plotted(view)
    window = ", last 2 min" if wide else ""
    if one is None or view.snapshot is None:
        return "no channel yet"
    if one.channel == COMMAND:
        return f"command (V) over time (s){window}"
    return f"{names(view.snapshot.channels)[one.channel]} ({unit(one.unit)}), command (V, right) over time (s){window}"


def misfit_since(view: View) -> float | None:
    """From which s of the recording on the watch says that the run does not fit; None where that is not on the plot."""
    watch = view.snapshot.watch if view.snapshot is not None else None
    if watch is None or watch.state != "mismatch" or not view.trace:
        return None
    return watch.began if view.trace[0][0] < watch.began < view.trace[-1][0] else None


def bands(view: View, channel: str, most: int) -> list[Band]:
    """The envelope of one channel in at most `most` equal spans of time: no peak is lost. Rows without a sample go."""
    channels = [one.channel for one in view.snapshot.channels] if view.snapshot is not None else []
    if channel not in channels:
        return []
    place = 1 + 2 * channels.index(channel)
    finite = [
        Band(row[0], row[place], row[place + 1])
        for row in view.trace
        if len(row) > place + 1 and math.isfinite(row[place]) and math.isfinite(row[place + 1])
    ]
    return merged(finite, view.trace, most)


def merged(found: Sequence[Band], rows: Sequence[TraceRow], most: int) -> list[Band]:
    """`found` in at most `most` spans of the time that `rows` cover."""
    span = rows[-1][0] - rows[0][0] if rows else 0.0
    if len(found) <= most or span <= 0.0:
        return list(found)
    groups: dict[int, Band] = {}
    for band in found:
        n = min(int((band.time - rows[0][0]) / span * most), most - 1)
        known = groups.get(n, band)
        groups[n] = Band(known.time, min(known.low, band.low), max(known.high, band.high))
    return list(groups.values())


def span_of(found: Sequence[Band], of_unit: str) -> tuple[float, float]:
    """The axis that holds all of it."""
    edges = [edge for band in found for edge in (band.low, band.high)]
    largest = max(map(abs, edges))
    return reach(edges, least=LEAST_SPAN.get(of_unit, max(1e-3 * largest, 1e-6)))


def dots(found: Sequence[Band], dot: float) -> tuple[list[float], list[float]]:
    """Times and values of the dots, each `dot` high, that fill the bands; both ends of each are there, and where that
    would be more than MOST_DOTS those between are further apart."""
    total = sum((band.high - band.low) / dot for band in found)
    step = dot * max(1.0, total / MOST_DOTS)
    times: list[float] = []
    values: list[float] = []
    for band in found:
        between = int((band.high - band.low) / step)
        column = [band.low, *(min(band.low + step * n, band.high) for n in range(1, between + 1)), band.high]
        values += column if band.high > band.low else [band.low]
        times += [band.time] * (len(column) if band.high > band.low else 1)
    return times, values
