"""What one run did, on intervals of time: what drove it, what was measured in each, and what else was recorded.

Intervals are short after a change of the driver and grow with the time since then, so that ten minutes at 100 Hz need
some thousand of them and a motor lag is still seen. Values are means over the interval.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.calibration.bend import CellBend
from identification.recording import Floats
from identification.run_history.converter import Converter
from identification.run_history.least_recently_used import LeastRecentlyUsed

TURNING = 0.02
"""Share of the largest driver above which it counts as driving."""
CHANGED = 0.01
"""Share of the largest driver: a smaller difference between neighbouring intervals is no step."""
BACK = 0.005
"""Share of the largest driver by which it must come back to have turned round."""
NOISES = 5.0
"""Standard deviations of a measured driver: a smaller difference may be its noise."""
LARGEST_LEAD = 0.2
"""Of the largest driver: what changes by more is a step even in a fast ramp, and no tick."""
LOUD_READINGS = 0.4, 0.9
"""Of the largest reading: above, the cell may clip; below, noise that is proportional is small."""
LEAST_IN_ROW, LEAST_SCATTER = 5, 200
"""Samples of an interval, and of a run, that tell how samples scatter."""
STILL = 1e-3
"""Share of the largest driver by which it may move within an interval that tells so."""
TAIL = 3.0
"""Times the standard deviation of the others: that of the samples in the tails."""
MOST_AFTER = 8
"""Delays and ticks of which is remembered which samples are after each tick."""
SAMPLE_BLOCK = 8192
"""Samples of which something is made at a time."""
SAMPLES = ("thrust_samples", "rate_samples")
"""What is worked out of samples and intervals alone."""
GLITCH = 30.0
"""Times the median: what is off by more is no noise."""


@dataclass(frozen=True, eq=False)
class Samples:
    """When the samples of a channel were taken."""

    time: Floats
    """(N,) s, none before the one before it."""
    interval: NDArray[np.intp]
    """(N,) index of the interval that each is in."""
    count: NDArray[np.intp]
    """(M,) samples in each interval."""
    middle: Floats
    """(M,) s, their mean time; the middle of the interval where there are none."""

    _begins: LeastRecentlyUsed[NDArray[np.intp]] = field(
        default_factory=lambda: LeastRecentlyUsed(MOST_AFTER), init=False, repr=False
    )
    _pieces: LeastRecentlyUsed[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]] = field(
        default_factory=lambda: LeastRecentlyUsed(MOST_AFTER), init=False, repr=False
    )

    def after(self, when: Floats, delay: float) -> tuple[NDArray[np.intp], Floats]:
        """(N,) the last of the ticks `when` (T,) that is `delay` s ago or longer, else the first, and s since then."""
        begin = self._begun(when, delay)
        last = np.repeat(np.arange(when.size), np.diff(begin, append=self.time.size))
        return last, np.maximum(self.time - delay - when[last], 0.0)

    def soon_after(
        self, when: Floats, delay: float, within: Floats
    ) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], Floats]]:
        """(k,) samples less than `within` (T,) s after the tick that `after` gives them; it, and s since then; in
        blocks, all of which is in a processor's own memory while something is made of them."""
        begin, late = self._begun(when, delay), self.time - delay
        end = np.minimum(np.append(begin[1:], late.size), np.searchsorted(late, when + within))
        many = np.maximum(end - begin, 0)
        total = np.cumsum(many)
        ends = np.unique(
            np.searchsorted(total, np.arange(SAMPLE_BLOCK, int(total[-1]) + SAMPLE_BLOCK, SAMPLE_BLOCK)) + 1
        )
        for lo, hi in zip([0, *ends], [*np.minimum(ends, when.size), when.size], strict=True):
            few = many[lo:hi]
            last = np.repeat(np.arange(lo, hi), few)
            which = np.arange(last.size) + np.repeat(begin[lo:hi] - (np.cumsum(few) - few), few)
            if which.size:
                yield which, last, np.maximum(late[which] - when[last], 0.0)

    def means_after(
        self,
        when: Floats,
        delay: float,
        within: Floats,
        told: Callable[[NDArray[np.intp], Floats], Floats],
        rows: int = 1,
    ) -> Floats:
        """(r, M) means over each interval of what is `told` (r, k) of the samples `soon_after` ticks, by the tick and s
        since then; of all others 0 counts. `rows`: r."""
        total = np.zeros((rows, self.count.size))
        for which, last, since in self.soon_after(when, delay, within):
            interval = self.interval[which]
            part = slice(interval[0], interval[-1] + 1)
            for row, value in zip(total, told(last, since), strict=True):
                row[part] += np.bincount(interval - interval[0], weights=value)
        total /= np.maximum(self.count, 1)
        return total

    def held_means(self, when: Floats, delay: float, value: Floats) -> Floats:
        """(M,) `means` of what is `value` (T,) from the ticks `when` on, `delay` s after."""
        interval, tick, many = self._pieces(delay, lambda: self._in_pieces(self._begun(when, delay)), when)
        total = np.bincount(interval, weights=value[tick] * many, minlength=self.count.size)
        out: Floats = total / np.maximum(self.count, 1)
        return out

    def _begun(self, when: Floats, delay: float) -> NDArray[np.intp]:
        """(T,) first sample of each tick; of the first tick are those before it, too."""

        def made() -> NDArray[np.intp]:
            first = np.searchsorted(self.time - delay, when)
            first[0] = 0
            return first

        return self._begins(delay, made, when)

    def _in_pieces(self, begin: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Samples of one interval and one tick, which begin at the samples `begin`: interval, tick, how many, or 0."""
        both = np.concatenate([2 * begin, 2 * (np.cumsum(self.count) - self.count) + 1])
        both.sort(kind="stable")  # of two that ascend: they are merged
        new = both & 1
        interval, tick = np.maximum(np.cumsum(new) - 1, 0), np.cumsum(1 - new) - 1
        return interval, tick, np.diff(both >> 1, append=self.time.size)

    def means(self, value: Floats) -> Floats:
        """(M,) means of values (N,) over each interval; 0 where there are none."""
        total = np.bincount(self.interval, weights=value, minlength=self.count.size)
        out: Floats = total / np.maximum(self.count, 1)
        return out


def samples_in(time: Floats, edges: Floats) -> Samples:
    time = time[(time >= edges[0]) & (time < edges[-1])]
    interval = np.searchsorted(edges, time, side="right") - 1
    count = np.bincount(interval, minlength=edges.size - 1)
    when = np.bincount(interval, weights=time, minlength=edges.size - 1) / np.maximum(count, 1)
    return Samples(time, interval, count, np.where(count > 0, when, 0.5 * (edges[1:] + edges[:-1])))


@dataclass(frozen=True, eq=False)
class History:
    """One run on M intervals. All arrays are read-only by agreement; SI."""

    recording_id: str
    driver_quantity: str
    """command_voltage, motor_voltage or rotation_rate."""
    edges: Floats
    """(M+1,) s."""
    driver: Floats
    """(M,) mean of the driver."""
    thrust: Floats
    """(M,) N, mean of the samples in the interval, NaN where there are none."""
    count: NDArray[np.int64]
    """(M,) thrust samples in the interval."""
    sampled: Floats
    """(M,) s, mean time of those samples; the middle of the interval where there are none."""
    within: Floats
    """(M,) N^2, sum of squares of the samples about the mean of their interval."""
    rate: Floats | None = None
    """(M,) rev/s, mean of the rotation rate measured in the interval, NaN where none."""
    rate_count: NDArray[np.int64] | None = None
    rate_sampled: Floats | None = None
    """(M,) s, mean time of the rate's samples."""
    others: Mapping[str, Floats] = None  # type: ignore[assignment]  # replaced in __post_init__
    """quantity -> (M,) interpolated: bus_voltage, flow_speed, current, torque, motor_temperature, water_temperature,
    rotation_rate, neighbour_thrust."""
    coarse: Mapping[str, float] = field(default_factory=dict)
    """Of these what was read in so few steps that the steps hide how it moved: by what share of that, one standard
    deviation."""
    quanta: Mapping[str, float] = field(default_factory=dict)
    """Of these, step of its readings in its own unit."""
    begun_error: float = 0.0
    """K, standard error of the motor temperature that the run began with."""
    rate_per_driver: float = 1.0
    """rev/s per unit of the driver, where both are steady; of no use without a rate."""
    spacing: float = 1.0
    """s between thrust samples."""
    jitter: float = 0.001
    """s by which the time stamps of the thrust may be off."""
    delay_std: float = 0.0
    """s by which all of them may be, against the driver, as the recording itself says."""
    quantum: float = 0.0
    """N, step of the thrust's values; 0 where they have none."""
    converter: Converter = field(default_factory=Converter)
    """Between the thrust and a sample of it."""
    cell: CellBend = field(default_factory=CellBend)
    """How straight dead weights left the load cell."""
    rate_spacing: float = 1.0
    excess: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    """(M,) or (1,): mean of driver |driver| over the interval less that of the mean driver."""
    lead: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    """(M,) or (1,): driver at the samples less its mean over the interval: ticks may keep step with samples."""
    curved: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    """(M,) or (1,): driver |driver| at the samples less what the line through its means and the lead make of it."""
    tick: float = 1.0
    """s between changes of the command where it ticks on."""
    driver_noise: float = 0.0
    """Of a sample of a measured driver, standard deviation in its unit."""
    level_errors: Floats = field(default_factory=lambda: np.empty((0, 0)), repr=False)
    """(M, k) in the driver's unit: what each level of a measured driver may be off by, one standard deviation."""
    rate_lead: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    ticks: tuple[Floats, Floats] | None = field(default=None, repr=False)
    """s, driver: every change of a command that is held between."""
    sample_time: Floats = field(default_factory=lambda: np.empty(0), repr=False)
    """(N,) s, every thrust sample that is in an interval."""
    sample_lead: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    """(N,) or (1,): as `lead`, at each sample, of a driver that was measured."""
    sample_thrust: Floats = field(default_factory=lambda: np.empty(0), repr=False)
    rate_time: Floats = field(default_factory=lambda: np.empty(0), repr=False)
    """(n,) s, every sample of the rotation rate."""
    static: bool = False
    """Levels without a course of time: nothing that moves can be seen."""

    def __post_init__(self) -> None:
        if self.others is None:
            object.__setattr__(self, "others", {})

    def with_driver(self, **changes: Any) -> History:
        """With another driver, or with what that does at the samples; they are in the intervals in which they were."""
        out = replace(self, **changes)
        vars(out).update({name: vars(self)[name] for name in SAMPLES if name in vars(self)})
        return out

    @cached_property
    def dt(self) -> Floats:
        out: Floats = np.diff(self.edges)
        return out

    @cached_property
    def middle(self) -> Floats:
        out: Floats = 0.5 * (self.edges[1:] + self.edges[:-1])
        return out

    @cached_property
    def thrust_samples(self) -> Samples:
        """Every thrust sample that is in an interval."""
        return samples_in(self.sample_time, self.edges)

    @cached_property
    def rate_samples(self) -> Samples:
        """Every sample of the rotation rate that is in an interval."""
        return samples_in(self.rate_time, self.edges)

    @cached_property
    def scatter(self) -> tuple[float, float] | None:
        """N and 1: standard deviation of a sample about the mean at the largest readings, and the share of samples
        that scatter TAIL times as much; None where too few samples tell. By the mean |e| and the mean e^2."""
        samples = self.thrust_samples
        if self.sample_thrust.size < LEAST_SCATTER or self.sample_thrust.size != samples.time.size:
            return None
        size, largest = np.abs(self.thrust), float(np.nanmax(np.abs(self.thrust)))
        low, high = (share * largest for share in LOUD_READINGS)
        moved = np.broadcast_to(np.abs(self.excess), size.shape)
        usual = (size < high) & (samples.count >= LEAST_IN_ROW) & (moved < (STILL * self.size) ** 2)
        loud, quiet = (self._beside_means(usual & which) for which in (size > low, size <= low))
        if loud is None:
            return None
        force, e = loud
        # second = s^2 (1 + (TAIL^2 - 1) w), first = s (1 + (TAIL - 1) w)
        first, second = float(np.mean(e)) * np.sqrt(np.pi / 2), float(np.mean(e**2))
        if first <= 0:
            return None
        q, a, b = second / first**2, TAIL - 1, TAIL**2 - 1
        root = (b - 2 * a * q) ** 2 - 4 * a**2 * q * (q - 1)
        w = max((b - 2 * a * q - float(np.sqrt(max(root, 0.0)))) / (2 * a**2 * q), 0.0)
        std = first / (1 + a * w)
        if quiet is not None:  # noise that is proportional is larger still at the largest readings
            there, here = float(np.mean(quiet[0] ** 2)), float(np.mean(force**2))
            share = max(1 - float(np.mean(quiet[1]) / np.mean(e)) ** 2, 0.0)
            std *= float(np.sqrt(1 + share * (largest**2 - here) / (here - there)))
        return std, w

    def _beside_means(self, usual: NDArray[np.bool_]) -> tuple[Floats, Floats] | None:
        """N: mean of its interval and |distance from it| of each sample in intervals `usual` (M,); None of too few."""
        samples = self.thrust_samples
        which = usual[samples.interval]
        if np.count_nonzero(which) < LEAST_SCATTER:
            return None
        at, n = samples.interval[which], samples.count[samples.interval[which]]
        e = np.abs(self.sample_thrust[which] - self.thrust[at]) * np.sqrt(n / (n - 1))
        return self.thrust[at], np.minimum(e, GLITCH * float(np.median(e)))

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Intervals with thrust."""
        return np.flatnonzero(self.count > 0)

    @cached_property
    def rate_rows(self) -> NDArray[np.intp]:
        """Intervals with a measured rotation rate."""
        return np.flatnonzero(np.isfinite(self.rate)) if self.rate is not None else np.empty(0, dtype=np.intp)

    @property
    def rates(self) -> Floats:
        """(m,) rev/s, at `rate_rows`."""
        return np.empty(0) if self.rate is None else np.asarray(self.rate[self.rate_rows], dtype=np.float64)

    @cached_property
    def size(self) -> float:
        """Largest |driver|."""
        return float(np.max(np.abs(self.driver), initial=0.0))

    @cached_property
    def level_start(self) -> NDArray[np.intp]:
        """(M,) index of the interval in which the present level began."""
        least = max(CHANGED * self.size, NOISES * self.driver_noise)
        new = np.abs(np.diff(self.driver, prepend=np.nan)) > least
        new[0] = True
        return np.maximum.accumulate(np.where(new, np.arange(new.size), 0))

    @cached_property
    def since_step(self) -> Floats:
        """(M,) s since the driver changed, at the middle of the interval."""
        out: Floats = self.middle - self.edges[self.level_start]
        return out

    @cached_property
    def direction_of_change(self) -> Floats:
        """(M,) 1 where the driver last went up, -1 where it went down, 0 before its first change; moving or held."""
        out = np.zeros(self.driver.size)
        way, furthest, play = 0.0, float(self.driver[0]), max(BACK * self.size, NOISES * self.driver_noise)
        for i, value in enumerate(self.driver.tolist()):
            if (value - furthest) * way > 0:
                furthest = value
            elif abs(value - furthest) > play:
                way, furthest = (1.0 if value > furthest else -1.0), value
            out[i] = way
        return out

    @cached_property
    def previous(self) -> Floats:
        """(M,) driver of the level before this one that was held for some time; 0 before the first."""
        starts = np.unique(self.level_start)
        ends = np.append(starts[1:], self.driver.size)
        held = self.edges[ends] - self.edges[starts] > max(0.3, 2 * float(np.median(self.dt)))
        before = np.zeros(starts.size)
        last = 0.0
        for i in range(starts.size):
            before[i] = last
            if held[i]:
                last = float(self.driver[starts[i]])
        which = np.searchsorted(starts, self.level_start)
        out: Floats = before[which]
        return out
