"""The latest value of every channel, as the guard judges it and the operator sees it. Pure: time is given."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import isnan
from types import MappingProxyType
from typing import Literal

from drivers.protocols import Sample, Stream
from rig.campaign.config import LimitConfig
from rig.campaign.limits import GuardedChannel, guarded_channels
from rig.link.front_end_messages import Reading
from rig.safety.guard import Allowances, Latest, Vitals, assess

RATE_WINDOW = 64
"""Rows per stream over which its real rate is measured."""

ReadingState = Literal["ok", "stale", "limit", "none"]
_STATES: Mapping[str, ReadingState] = MappingProxyType(
    {"limit": "limit", "emergency_stop": "limit", "nan": "none", "stale": "stale"}
)


@dataclass(slots=True)
class Sameness:
    """How long one channel has kept the very same value. Times in ns."""

    stream: str
    column: int
    value: float = float("nan")
    since_ns: int = 0
    longest_ns: int | None = None
    """Of the times that ended with a change."""

    def update(self, sample: Sample) -> None:
        value = sample.values[self.column]
        if value == self.value:
            return
        if not isnan(self.value):
            self.longest_ns = max(self.longest_ns or 0, sample.t_ns - self.since_ns)
        self.value, self.since_ns = value, sample.t_ns


@dataclass
class Readings:
    """Latest row per stream, judged by the same rules as the guard's."""

    streams: Mapping[str, Stream]
    limits: tuple[LimitConfig, ...]
    latest: dict[str, Sample] = field(default_factory=dict)
    arrivals: dict[str, deque[int]] = field(default_factory=dict)
    rows: dict[str, int] = field(default_factory=dict)
    """Rows so far per stream."""
    shown: Mapping[str, GuardedChannel] = field(init=False)
    place: Mapping[str, tuple[str, int, str]] = field(init=False)
    """Channel -> stream, column, quantity."""
    sameness: dict[str, Sameness] = field(default_factory=dict)
    """Of the channels that are watched for being frozen."""

    def __post_init__(self) -> None:
        self.place = {
            f"{stream.name}.{channel.name}": (stream.name, column, channel.quantity or "")
            for stream in self.streams.values()
            for column, channel in enumerate(stream.channels)
        }
        measured = [name for name, (_, _, quantity) in self.place.items() if quantity]
        self.shown = {one.channel: one for one in guarded_channels(self.limits, self.streams.values(), measured)}

    def watch_sameness(self, channels: Iterable[str]) -> None:
        """From now on keep how long these have stood still."""
        self.sameness = {channel: Sameness(*self.place[channel][:2]) for channel in channels}

    def update(self, samples: Iterable[Sample]) -> None:
        for sample in samples:
            name = sample.stream
            self.latest[name] = sample
            self.rows[name] = self.rows.get(name, 0) + 1
            arrivals = self.arrivals.get(name)
            if arrivals is None:
                arrivals = self.arrivals[name] = deque(maxlen=RATE_WINDOW)
            arrivals.append(sample.t_ns)
            for same in self.sameness.values():
                if same.stream == name:
                    same.update(sample)

    def newest(self, channel: str) -> Latest | None:
        """Latest value of `<stream>.<channel>` and its arrival in s; None before the first row."""
        stream, column, _ = self.place[channel]
        sample = self.latest.get(stream)
        if sample is None:
            return None
        same = self.sameness.get(channel)
        if same is None:
            return Latest(sample.values[column], sample.t_ns * 1e-9)
        longest = None if same.longest_ns is None else same.longest_ns * 1e-9
        return Latest(sample.values[column], sample.t_ns * 1e-9, (sample.t_ns - same.since_ns) * 1e-9, longest)

    def fresh(self, channel: str, now: float) -> float | None:
        """Newest value; None when there is none, it is NaN, or it is older than the channel's `max_age`."""
        newest = self.newest(channel)
        if newest is None or isnan(newest.value) or now - newest.time > self.shown[channel].max_age:
            return None
        return newest.value

    def rate(self, stream: str) -> float | None:
        """Rows per second over the last rows; None with fewer than three."""
        times = self.arrivals.get(stream)
        if times is None or len(times) < 3 or times[-1] == times[0]:
            return None
        return (len(times) - 1) / ((times[-1] - times[0]) * 1e-9)

    def age(self, stream: str, now: float) -> float:
        """Seconds since its last row; 0 before the first."""
        sample = self.latest.get(stream)
        return 0.0 if sample is None else now - sample.t_ns * 1e-9

    def forget(self, streams: Iterable[str]) -> None:
        """Their device is opened anew: its rate is counted from here."""
        for stream in streams:
            self.latest.pop(stream, None)
            self.arrivals.pop(stream, None)

    def view(self, now: float) -> tuple[Reading, ...]:
        """Every channel that has a quantity or a limit; `now` in s."""
        return tuple(self._reading(guarded, now) for guarded in self.shown.values())

    def _reading(self, guarded: GuardedChannel, now: float) -> Reading:
        quantity = self.place[guarded.channel][2]
        newest = self.newest(guarded.channel)
        trip = assess(guarded, newest, Vitals(now, now), Allowances(grace=0.0))
        state: ReadingState = "none" if newest is None else _STATES[trip.source] if trip else "ok"
        value = None if newest is None or isnan(newest.value) else newest.value
        age = None if newest is None else max(now - newest.time, 0.0)
        return Reading(
            guarded.channel, quantity, guarded.unit, value, age, guarded.min, guarded.max, guarded.max_age, state
        )
