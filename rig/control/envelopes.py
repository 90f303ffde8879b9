"""Least and greatest of every recorded channel in each tenth of a second: what plots are drawn from.

However fast a device sends, a front end is given two numbers a channel and tenth of a second, and no peak is lost.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, nan

from drivers.protocols import Sample, Stream
from rig.campaign.bench import COMMAND_STREAM
from rig.link.front_end_messages import TracedChannel, TraceRow

PERIOD = 0.1
"""s of one row: as often as snapshots are sent."""


class Envelopes:
    """Of one bench. Nothing is kept but the row that is being made."""

    def __init__(self, streams: Iterable[Stream]) -> None:
        self.channels: tuple[TracedChannel, ...] = (TracedChannel(COMMAND_STREAM, "command_voltage", "V"),)
        """The command that is sent, then every channel of the bench in its order."""
        self._first: dict[str, int] = {}
        for stream in streams:
            self._first[stream.name] = len(self.channels)
            self.channels += tuple(
                TracedChannel(f"{stream.name}.{channel.name}", channel.quantity or "", channel.unit)
                for channel in stream.channels
            )
        self._period = -1
        """Number of the running tenth of a second since the recording began; -1: there is no recording."""
        self._clear()

    def advance(
        self, samples: Iterable[Sample], command: float | None, since_ns: int | None, now: float
    ) -> TraceRow | None:
        """One tick at `now` in s: the row of the tenth of a second that it ends, if it does.

        `command`: V sent in this tick, None: nothing was. `since_ns`: t = 0 of the recording, None: there is none;
        samples from before it are left out. A NaN counts as no sample.
        """
        period = -1 if since_ns is None else int((now - since_ns * 1e-9) / PERIOD)
        row = self._row() if period != self._period and self._period >= 0 else None
        self._period = period
        if since_ns is not None:
            self._take(samples, since_ns)
            if command is not None:
                self._widen(0, command)
        return row

    def _take(self, samples: Iterable[Sample], since_ns: int) -> None:
        rows: dict[str, list[tuple[float, ...]]] = {}
        for sample in samples:
            if sample.t_ns >= since_ns and sample.stream in self._first:
                rows.setdefault(sample.stream, []).append(sample.values)
        low, high = self._low, self._high
        for stream, values in rows.items():
            for place, column in enumerate(zip(*values, strict=True), self._first[stream]):
                low[place] = min(low[place], *column)  # that they come first keeps NaN out: nothing is below it
                high[place] = max(high[place], *column)

    def _widen(self, place: int, value: float) -> None:
        self._low[place] = min(self._low[place], value)
        self._high[place] = max(self._high[place], value)

    def _row(self) -> TraceRow:
        row = [(self._period + 0.5) * PERIOD]
        for low, high in zip(self._low, self._high, strict=True):
            row += (low, high) if low <= high else (nan, nan)
        self._clear()
        return tuple(row)

    def _clear(self) -> None:
        self._low = [inf] * len(self.channels)
        self._high = [-inf] * len(self.channels)
