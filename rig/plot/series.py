"""Channels of recordings over time, one panel each on a common axis, and how a channel is asked for by name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import chain

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.recording import Channel, Recording
from rig.errors import RecordingError
from rig.report.style import DATA, INK, WIDE, Plot, drawable, labels, unit_text

SHOWN = ("command_voltage", "thrust", "rotation_rate", "current", "bus_voltage", "flow_speed", "water_temperature")
"""Quantities of a figure over time when no channel is named, in this order, those that were recorded."""
PANEL = 1.35
"""inches high, each."""
DASHES = ("-", "--", ":", "-.")
"""Of the first, second ... recording in one panel, so that they differ without colour."""
MARKED = 60
"""Fewer rows than this are dots beside the line: a slow device's rows can be counted."""


@dataclass(frozen=True, eq=False)
class Panel:
    """One quantity: its name with its unit, and a channel of each recording that has it."""

    label: str
    channels: tuple[Channel, ...]


def shown(recordings: Sequence[Recording]) -> tuple[Panel, ...]:
    """The usual panels of recordings. Raises RecordingError where none of these quantities was recorded."""
    found = [_panel(name, [r.first_of(name) for r in recordings]) for name in SHOWN]
    panels = tuple(panel for panel in found if panel.channels)
    if not panels:
        raise RecordingError(
            f"{recordings[0].source}: none of {', '.join(SHOWN)} was recorded; name a channel: {_known(recordings)}"
        )
    return panels


def named(name: str, recordings: Sequence[Recording]) -> Panel:
    """The panel of a channel: `stream.channel`, its name alone, or its quantity. Raises RecordingError."""
    panel = _panel(name, [_channel(name, recording) for recording in recordings])
    if not panel.channels:
        names = list(chain.from_iterable(_names(channel) for r in recordings for channel in r.channels))
        near = get_close_matches(name, names, 1)
        meant = f"; did you mean {near[0]}?" if near else f"; it has {_known(recordings)}"
        raise RecordingError(f"{recordings[0].source}: there is no channel {name[:60]!r} with values in it{meant}")
    return panel


def over_time(panels: Sequence[Panel]) -> Plot:
    """All panels above one time axis."""
    told = "; ".join(f"{panel.label} from {_span(panel.channels)}" for panel in panels)
    height = max(PANEL * len(panels) + 0.7, 2.4)
    end = max(float(channel.time[-1]) for panel in panels for channel in panel.channels)

    def draw(figure: Figure) -> None:
        rows = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, panel in zip(rows, panels, strict=True):
            for i, channel in enumerate(panel.channels):
                _draw(axes, channel, end, DASHES[i % len(DASHES)], (DATA, INK)[i % 2])
            labels(axes, "", "")
            axes.set_title(panel.label)
        rows[-1].set_xlabel("time since the recording began / s")

    return Plot(draw, f"Over time: {told}.", (WIDE[0], height))


def _draw(axes: Axes, channel: Channel, end: float, dash: str, colour: str) -> None:
    """A command holds from its row to the next and at last to the end; what was measured is a line."""
    good = np.isfinite(channel.value)
    if channel.quantity == "command_voltage":
        t, y = np.append(channel.time[good], end), np.append(channel.value[good], channel.value[good][-1])
        axes.step(t, y, dash, where="post", color=colour)
        return
    few = good.sum() <= MARKED
    axes.plot(*drawable(channel.time[good], channel.value[good]), dash, color=colour, marker="." if few else "", lw=1.1)


def _panel(name: str, found: Iterable[Channel | None]) -> Panel:
    channels = tuple(c for c in found if c is not None and np.any(np.isfinite(c.value)))
    if not channels:
        return Panel(name, ())
    unit = unit_text(channels[0].unit)
    return Panel(name.replace("_", " ") + (f" / {unit}" if unit else ""), channels)


def _names(channel: Channel) -> tuple[str, ...]:
    return (f"{channel.stream}.{channel.name}", channel.name, *([channel.quantity] if channel.quantity else []))


def _channel(name: str, recording: Recording) -> Channel | None:
    """The full name before the short one, and both before a quantity, of which the first that counts is meant."""
    wanted = name.replace("/", ".")
    for place in (0, 1):
        for channel in recording.channels:
            if _names(channel)[place] == wanted:
                return channel
    return recording.first_of(wanted)


def _known(recordings: Sequence[Recording]) -> str:
    return ", ".join(_names(channel)[0] for channel in recordings[0].channels)


def _span(channels: Sequence[Channel]) -> str:
    low = min(float(np.nanmin(c.value)) for c in channels)
    high = max(float(np.nanmax(c.value)) for c in channels)
    return f"{low:.4g} to {high:.4g}"
