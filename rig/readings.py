"""The latest value of every channel, as the guard judges it and the operator sees it. Pure: time is given."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import isnan
from types import MappingProxyType
from typing import Literal

from drivers.protocols import Sample, Stream
from rig.config import LimitConfig
from rig.guard import Allowances, Latest, Vitals, Watch, assess, watches
from rig.messages import Reading

RATE_WINDOW = 64
"""Rows per stream over which its real rate is measured."""

ReadingState = Literal["ok", "stale", "limit", "none"]
_STATES: Mapping[str, ReadingState] = MappingProxyType({"limit": "limit", "nan": "none", "stale": "stale"})


@dataclass
class Readings:
    """Latest row per stream, judged by the same rules as the guard's."""

    streams: Mapping[str, Stream]
    limits: tuple[LimitConfig, ...]
    latest: dict[str, Sample] = field(default_factory=dict)
    arrivals: dict[str, deque[int]] = field(default_factory=dict)
    shown: Mapping[str, Watch] = field(init=False)
    place: Mapping[str, tuple[str, int, str]] = field(init=False)
    """Channel -> stream, column, quantity."""

    def __post_init__(self) -> None:
        self.place = {
            f"{stream.name}.{channel.name}": (stream.name, column, channel.quantity or "")
            for stream in self.streams.values()
            for column, channel in enumerate(stream.channels)
        }
        measured = [name for name, (_, _, quantity) in self.place.items() if quantity]
        self.shown = {watch.channel: watch for watch in watches(self.limits, self.streams.values(), measured)}

    def update(self, samples: Iterable[Sample]) -> None:
        for sample in samples:
            self.latest[sample.stream] = sample
            self.arrivals.setdefault(sample.stream, deque(maxlen=RATE_WINDOW)).append(sample.t_ns)

    def newest(self, channel: str) -> Latest | None:
        """Latest value of `<stream>.<channel>` and its arrival in s; None before the first row."""
        stream, column, _ = self.place[channel]
        sample = self.latest.get(stream)
        return None if sample is None else Latest(sample.values[column], sample.t_ns * 1e-9)

    def rate(self, stream: str) -> float | None:
        """Rows per second over the last rows; None with fewer than three."""
        times = self.arrivals.get(stream)
        if times is None or len(times) < 3 or times[-1] == times[0]:
            return None
        return (len(times) - 1) / ((times[-1] - times[0]) * 1e-9)

    def view(self, now: float) -> tuple[Reading, ...]:
        """Every channel that has a quantity or a limit; `now` in s."""
        return tuple(self._reading(watch, now) for watch in self.shown.values())

    def _reading(self, watch: Watch, now: float) -> Reading:
        quantity = self.place[watch.channel][2]
        newest = self.newest(watch.channel)
        trip = assess(watch, newest, Vitals(now, now), Allowances(grace=0.0))
        state: ReadingState = "none" if newest is None else _STATES[trip.source] if trip else "ok"
        value = None if newest is None or isnan(newest.value) else newest.value
        age = None if newest is None else max(now - newest.time, 0.0)
        return Reading(watch.channel, quantity, watch.unit, value, age, watch.min, watch.max, watch.max_age, state)
