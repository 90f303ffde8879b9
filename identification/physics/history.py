"""What one run did, on intervals of time: what drove it, what was measured in each, and what else was recorded.

Intervals are short after a change of the driver and grow with the time since then, so that ten minutes at 100 Hz need
some thousand of them and a motor lag is still seen. Values are means over the interval.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identification.physics.filters import delayed, reconstructed
from identification.physics.tick_rows import TickRows, tick_rows
from identification.recording import Floats

TURNING = 0.02
"""Share of the largest driver above which it counts as driving."""
CHANGED = 0.01
"""Share of the largest driver: a smaller difference between neighbouring intervals is no step."""
LED = 2.0
"""Ticks for which the response to one is followed..."""
LEDS = 61
"""...at so many delays."""
MOST_LED = 8
LARGEST_LEAD = 0.02
"""Of the largest driver: what changes by more is a step, and no tick."""
LEAST_DELAY = 0.02
"""Of a tick: a shorter delay leaves what the driver does within its ticks where it was."""


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
    rate_per_driver: float = 1.0
    """rev/s per unit of the driver, where both are steady; of no use without a rate."""
    spacing: float = 1.0
    """s between thrust samples."""
    jitter: float = 0.001
    """s by which the time stamps of the thrust may be off."""
    rate_spacing: float = 1.0
    excess: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    """(M,) or (1,): mean of driver |driver| over the interval less that of the mean driver."""
    lead: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    """(M,) or (1,): driver at the samples less its mean over the interval: ticks may keep step with samples."""
    tick: float = 1.0
    """s between changes of the command where it ticks on."""
    rate_lead: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    ticks: tuple[Floats, Floats] | None = field(default=None, repr=False)
    """s, driver: every change of a command that is held between."""
    sample_time: Floats = field(default_factory=lambda: np.empty(0), repr=False)
    """(N,) s, every thrust sample that is in an interval."""
    sample_lead: Floats = field(default_factory=lambda: np.zeros(1), repr=False)
    """(N,) or (1,): as `lead`, at each sample."""
    sample_thrust: Floats = field(default_factory=lambda: np.empty(0), repr=False)
    memo: OrderedDict[object, Floats] = field(default_factory=OrderedDict, repr=False)
    """Values behind the first terms of models predicted lately: a fit moves one parameter at a time."""
    led: dict[float, Floats] = field(default_factory=dict, repr=False)
    """`leads_after`, by delay."""
    static: bool = False
    """Levels without a course of time: nothing that moves can be seen."""

    def __post_init__(self) -> None:
        if self.others is None:
            object.__setattr__(self, "others", {})

    @cached_property
    def dt(self) -> Floats:
        out: Floats = np.diff(self.edges)
        return out

    @cached_property
    def middle(self) -> Floats:
        out: Floats = 0.5 * (self.edges[1:] + self.edges[:-1])
        return out

    @cached_property
    def tick_rows(self) -> TickRows | None:
        """What the ticks of the command tell within the intervals; None where they tell nothing."""
        return tick_rows(self)

    def lead_after(self, delay: float) -> Floats:
        """`lead` of a force that comes `delay` s after the driver."""
        if self.ticks is None or abs(delay) < LEAST_DELAY * self.tick:
            return self.lead
        known = self.memo.get(("lead", delay))
        if known is None:
            known = self.memo[("lead", delay)] = self._led(delay)
        return known

    def leads_after(self, delay: float) -> tuple[Floats, Floats]:
        """(k,) s after `delay`, and (k, M) the leads of forces that come so much later: two ticks in fine steps."""
        later = np.linspace(0.0, LED * self.tick, LEDS)
        key = round(delay, 4)
        if key not in self.led:
            if len(self.led) >= MOST_LED:  # some megabytes each
                self.led.clear()
            self.led[key] = np.array([self._led(delay + d) for d in later])
        return later, self.led[key]

    def _led(self, delay: float) -> Floats:
        assert self.ticks is not None
        at, value = self.ticks
        now = value[np.clip(np.searchsorted(at, self.sample_time - delay, side="right") - 1, 0, at.size - 1)]
        mean = np.bincount(self._sample_index, weights=now, minlength=self.driver.size) / np.maximum(self.count, 1)
        line = reconstructed(delayed(self.driver, self.edges, delay), self.middle, self.sampled)
        lead = np.where(self.count > 0, mean - line, 0.0)
        out: Floats = np.where(np.abs(lead) < LARGEST_LEAD * self.size, lead, 0.0)
        return out

    @cached_property
    def _sample_index(self) -> NDArray[np.intp]:
        """(N,) interval of each thrust sample."""
        index = np.searchsorted(self.edges, self.sample_time, side="right") - 1
        return np.clip(index, 0, self.driver.size - 1)

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
        new = np.abs(np.diff(self.driver, prepend=np.nan)) > CHANGED * self.size
        new[0] = True
        return np.maximum.accumulate(np.where(new, np.arange(new.size), 0))

    @cached_property
    def since_step(self) -> Floats:
        """(M,) s since the driver changed, at the middle of the interval."""
        out: Floats = self.middle - self.edges[self.level_start]
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
