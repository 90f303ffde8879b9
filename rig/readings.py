"""The latest value of every channel, as the guard judges it and the operator sees it. Pure: time is given."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from drivers.protocols import Sample, Stream
from rig.config import LimitConfig
from rig.messages import Reading

RATE_WINDOW = 64
"""Rows per stream over which its real rate is measured."""


def default_max_age(period_s: float) -> float:
    """s after which a channel is stale: three sample periods, at least 0.2 s (reliability.md, promise 7)."""
    return max(3.0 * period_s, 0.2)


@dataclass
class Readings:
    """Latest row per stream, and the age limits that go with it."""

    streams: Mapping[str, Stream]
    limits: Mapping[str, LimitConfig]
    latest: dict[str, Sample] = field(default_factory=dict)
    arrivals: dict[str, deque[int]] = field(default_factory=dict)

    def update(self, samples: Iterable[Sample]) -> None:
        for sample in samples:
            self.latest[sample.stream] = sample
            self.arrivals.setdefault(sample.stream, deque(maxlen=RATE_WINDOW)).append(sample.t_ns)

    def value(self, channel: str) -> float | None:
        """Latest value of `<stream>.<channel>`; None before the first row."""
        stream, _, name = channel.partition(".")
        sample = self.latest.get(stream)
        if sample is None:
            return None
        names = [c.name for c in self.streams[stream].channels]
        return sample.values[names.index(name)]

    def rate(self, stream: str) -> float | None:
        """Rows per second over the last rows; None with fewer than three."""
        times = self.arrivals.get(stream)
        if times is None or len(times) < 3 or times[-1] == times[0]:
            return None
        return (len(times) - 1) / ((times[-1] - times[0]) * 1e-9)

    def view(self, now_ns: int) -> tuple[Reading, ...]:
        """Every channel that has a quantity or a limit."""
        return tuple(
            self._reading(stream, index, now_ns)
            for stream in self.streams.values()
            for index, channel in enumerate(stream.channels)
            if channel.quantity or f"{stream.name}.{channel.name}" in self.limits
        )

    def _reading(self, stream: Stream, index: int, now_ns: int) -> Reading:
        channel = stream.channels[index]
        name = f"{stream.name}.{channel.name}"
        limit = self.limits.get(name, LimitConfig(name))
        max_age = limit.max_age if limit.max_age is not None else default_max_age(stream.period_s)
        sample = self.latest.get(stream.name)
        if sample is None:
            return Reading(
                name, channel.quantity or "", channel.unit, None, None, limit.min, limit.max, max_age, "none"
            )
        value = sample.values[index]
        age = max((now_ns - sample.t_ns) * 1e-9, 0.0)
        state = _judge(value, age, limit, max_age)
        shown = None if math.isnan(value) else value
        return Reading(name, channel.quantity or "", channel.unit, shown, age, limit.min, limit.max, max_age, state)


def _judge(value: float, age: float, limit: LimitConfig, max_age: float) -> str:
    if age > max_age:
        return "stale"
    if math.isnan(value):
        return "none"
    if (limit.min is not None and value < limit.min) or (limit.max is not None and value > limit.max):
        return "limit"
    return "ok"
