"""Samples of a run as they come, reduced to stretches: the mean thrust of a hold, or of some seconds of a sweep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import isfinite, isnan

import numpy as np

from identification.recording import Floats
from identification.steady_state.settling import settle

BATCH = 0.1
"""s averaged at once: what is kept of a stretch are such means."""
LEAST_WAIT = 0.3
"""s after a step that are never used; settling itself is found from the samples."""
SWEEPING = 0.5
"""s; a command that changes sooner than this after its last change is a sweep, not a hold."""
LEAST_SWEEP = 2.0
"""s of a sweep that make a stretch."""
PASSING = 5.0
"""s of a sweep before its first stretch: shorter ones are the way from one hold to the next, and less sure."""
LEAST = 5
"""Batches that make a stretch of a hold."""
LONGEST = 6.0
"""s; a longer hold makes several stretches, so that a change within it is seen."""
OLD = 5.0
"""s after which a slow channel's last value is no longer the present."""

FEATURES = ("x", "abs_x", "v", "sign", "running", "x_abs_x")
"""Of the command v = V / highest, averaged over a stretch: v|v|, v^2, v, sgn v, 1 while not 0 V, v|v| v^2."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """One row of evidence. Times in s, voltages in V, forces in N."""

    start: float
    end: float
    volts: float
    """Mean command."""
    features: tuple[float, ...]
    """FEATURES, means over the samples."""
    slope: float
    """d(v|v|)/dt of a sweep, 1/s; 0 in a hold."""
    expected: float
    """N, the mean of the reference's prediction; 0 where there is none."""
    thrust: float
    """N, mean of what was measured."""
    variance: float
    """N^2 of one batch about its neighbours: the fast noise."""
    used: float
    """s of samples in the mean."""
    bus: float
    """V, mean; NaN where it was not measured."""
    flow: float
    """m/s, mean; 0 where it was not measured."""
    rate: float
    """rev/s, mean; NaN where it was not measured."""


@dataclass
class Slow:
    """A channel beside the thrust: its mean over the running stretch, or its last value while that is not old."""

    total: float = 0.0
    count: int = 0
    last: float = float("nan")
    at: float = -np.inf

    def take(self, time: Floats, value: Floats) -> None:
        good = np.isfinite(value)
        if good.any():
            self.total += float(value[good].sum())
            self.count += int(good.sum())
            self.last, self.at = float(value[good][-1]), float(time[good][-1])

    def mean(self, now: float) -> float:
        """Of the stretch that ends `now`."""
        if self.count:
            return self.total / self.count
        return self.last if now - self.at <= OLD else float("nan")

    def clear(self) -> None:
        self.total, self.count = 0.0, 0


@dataclass
class Batches:
    """Means of BATCH s under one command, as they fill."""

    time: list[float] = field(default_factory=list)
    value: list[float] = field(default_factory=list)
    _sum: float = 0.0
    _count: int = 0
    _bin: int = -1

    def take(self, since: float, time: Floats, value: Floats) -> None:
        """Finite samples in order; the batches are counted from `since` (s)."""
        bins = ((time - since) / BATCH).astype(np.int64)
        edges = np.flatnonzero(np.diff(bins)) + 1
        for part, number in zip(np.split(value, edges), bins[np.concatenate([[0], edges])].tolist(), strict=True):
            if number != self._bin:
                self._finish(since)
                self._bin = number
            self._sum += float(part.sum())
            self._count += part.size

    def _finish(self, since: float) -> None:
        if self._count:
            self.time.append(since + (self._bin + 0.5) * BATCH)
            self.value.append(self._sum / self._count)
        self._sum, self._count = 0.0, 0


def fast_variance(values: Floats) -> float:
    """Of one batch, from its differences to the next: slow noise and what is left of a settling are not in it.

    >>> bool(abs(fast_variance(np.random.default_rng(1).normal(0, 2, 4000) + np.arange(4000.0)) / 4 - 1) < 0.2)
    True
    """
    return float(np.mean(np.diff(values) ** 2) / 2) if values.size > 1 else 0.0


Expected = Callable[[float, float, float, float], float]
"""(V, bus V, flow m/s, rev/s) -> N that a known model gives there, settled."""


@dataclass
class Stretches:
    """Cuts one run into stretches. Memory does not grow: a hold keeps LONGEST s of batches, a sweep a few sums."""

    highest: float
    """V of the largest command there may be: the unit of v."""
    expected: Expected | None = None
    bus: Slow = field(default_factory=Slow)
    flow: Slow = field(default_factory=Slow)
    rate: Slow = field(default_factory=Slow)
    done: list[Stretch] = field(default_factory=list)
    """Finished ones, for the caller to take away."""
    _volts: float = float("nan")
    _since: float = 0.0
    _step: bool = True
    """The hold began with a step; False: it is the continuation of one that was cut for its length."""
    _batches: Batches = field(default_factory=Batches)
    _sweeping: float | None = None
    """s since which the command has been moving; None while it is held."""
    _swept: list[tuple[float, float, float, Floats, float]] = field(default_factory=list)
    """(s, duration, V, batch values, N expected) of the short holds a sweep is made of, LEAST_SWEEP s at most."""

    def command(self, time: float, volts: float) -> None:
        """The command from `time` (s) on; NaN: nothing is sent, and nothing is judged until it is."""
        if volts == self._volts or (isnan(volts) and isnan(self._volts)):
            return
        if isfinite(self._volts):
            self._close(time)
        if not isfinite(volts):
            self._swept.clear()
            self._sweeping = None
        self._begin(time, volts, step=True)

    def thrust(self, time: Floats, value: Floats) -> None:
        """Samples (n,) s, N, in order; NaN are left out, and so is what was taken before the running command."""
        good = np.isfinite(value) & (time >= self._since)
        if not isfinite(self._volts) or not good.any():
            return
        time, value = time[good], value[good]
        while time.size:
            limit = self._since + LONGEST + (LEAST_WAIT if self._step else 0.0)
            inside = int(np.searchsorted(time, limit, side="left"))
            if inside:
                self._batches.take(self._since, time[:inside], value[:inside])
            time, value = time[inside:], value[inside:]
            if time.size:
                self._hold(limit)
                self._begin(float(time[0]), self._volts, step=False)

    def _begin(self, time: float, volts: float, *, step: bool) -> None:
        self._volts, self._since, self._step = volts, time, step
        self._batches = Batches()

    def _close(self, time: float) -> None:
        self._batches._finish(self._since)
        if time - self._since >= SWEEPING or not self._step:
            self._swept.clear()
            self._sweeping = None
            self._hold(time)
            return
        if self._sweeping is None:
            self._sweeping = self._since
        values = np.array(self._batches.value)
        if values.size:
            expected = self._expected(self._volts, time)
            self._swept.append((self._since, time - self._since, self._volts, values, expected))
        if self._swept and time - self._swept[0][0] >= LEAST_SWEEP:
            if self._swept[0][0] - self._sweeping >= PASSING:
                self._sweep(time)
            self._swept.clear()

    def _expected(self, volts: float, now: float) -> float:
        if self.expected is None:
            return 0.0
        flow = self.flow.mean(now)
        return self.expected(volts, self.bus.mean(now), flow if isfinite(flow) else 0.0, self.rate.mean(now))

    def _hold(self, end: float) -> None:
        self._batches._finish(self._since)
        time, value = np.array(self._batches.time), np.array(self._batches.value)
        first = 0
        if self._step:
            first = max(settle(value).cut if value.size >= LEAST else 0, round(LEAST_WAIT / BATCH))
        time, value = time[first:], value[first:]
        if value.size >= LEAST:
            features = np.array([features_of(self._volts / self.highest)])
            expected = self._expected(self._volts, end)
            used = value.size * BATCH
            self._emit(time[0] - BATCH / 2, end, self._volts, features[0], 0.0, value, used, expected)

    def _sweep(self, end: float) -> None:
        weights = np.array([values.size for _, _, _, values, _ in self._swept], dtype=np.float64)
        volts = np.array([v for _, _, v, _, _ in self._swept])
        features = np.array([features_of(v / self.highest) for v in volts.tolist()])
        mean = weights @ features / weights.sum()
        start = self._swept[0][0]
        slope = (features[-1, 0] - features[0, 0]) / (end - start)
        values = np.concatenate([values for _, _, _, values, _ in self._swept])
        expected = float(weights @ np.array([e for *_, e in self._swept]) / weights.sum())
        middle = float(weights @ volts / weights.sum())
        self._emit(start, end, middle, mean, float(slope), values, end - start, expected)

    def _emit(
        self,
        start: float,
        end: float,
        volts: float,
        features: Floats,
        slope: float,
        values: Floats,
        used: float,
        expected: float,
    ) -> None:
        flow = self.flow.mean(end)
        self.done.append(
            Stretch(
                start=float(start),
                end=float(end),
                volts=volts,
                features=tuple(features.tolist()),
                slope=slope,
                expected=expected,
                thrust=float(values.mean()),
                variance=fast_variance(values),
                used=used,
                bus=self.bus.mean(end),
                flow=flow if isfinite(flow) else 0.0,
                rate=self.rate.mean(end),
            )
        )
        for slow in (self.bus, self.flow, self.rate):
            slow.clear()


def features_of(v: float) -> tuple[float, ...]:
    """FEATURES of one command, as a share of the highest."""
    sign = float(np.sign(v))
    return (v * abs(v), v * v, v, sign, abs(sign), v * abs(v) * v * v)
