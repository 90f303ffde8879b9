"""The watcher of one run: samples in as they come, an alarm out when the run no longer fits what it was."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import exp, isfinite

import numpy as np

from identification.recording import Floats
from identification.watching.alarm import Alarm
from identification.watching.evidence import Evidence, Posterior, level_of
from identification.watching.laws import KNOWN_LEVELS, LEVELS, REFERENCE, laws
from identification.watching.signatures import BUS, RAMP, RAMPS, SIGNATURES, STATIC, Place, signature_row, static_row
from identification.watching.stretches import BATCH, Expected, Stretch, Stretches

FALSE_ALARMS = 0.05
"""Per hour, by default."""
BINS = 16
"""Of the command, from the lowest to the highest, that may each deviate from the smooth static curve."""
FROM_START = 0.1
"""h of allowance for a run that does not fit its known model from the start on; only with one."""
KNOWN = 0.005
"""Relative standard deviation that a known model has at least from one mounting to the next, in gain and in shape."""
LIKELY = 0.1
"""Probability from which another place is named beside the best."""
MOST_WAITING = 4096
"""Commands that wait for samples of thrust."""
LOUDEST = 1e4
"""Fast noise while running is at most this much louder (in variance) than at rest for the weights of the means."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What is watched with."""

    highest: float
    """V, the largest |command| there may be."""
    false_alarms_per_hour: float = FALSE_ALARMS
    expected: Expected | None = None
    """A model known before the run, settled; None: the static curve is learnt from the run itself."""
    model_std: float = KNOWN
    """Relative standard deviation of that model's gain, at least KNOWN."""

    def __post_init__(self) -> None:
        if not 0 < self.highest < np.inf:
            raise ValueError(f"highest must be a voltage above 0 V, got {self.highest!r}")
        if not 0 < self.false_alarms_per_hour < np.inf:
            raise ValueError(f"false_alarms_per_hour must be above 0, got {self.false_alarms_per_hour!r}")


class Watch:
    """One run of one thruster; another mounting needs another Watch.

    Feed `command`, `thrust` and what else is measured as they come, each in order of time; `look` says what there is to
    say. A command is fed before the samples of thrust that were taken under it; it waits for those taken before it.

    >>> watch = Watch(Settings(highest=10.0))
    >>> rng = np.random.default_rng(3)
    >>> for k in range(60):  # holds of 5 s at 20 samples/s; from 150 s on the zero is 0.5 N off
    ...     volts = (0.0, 6.0, -6.0, 10.0, -10.0)[k % 5]
    ...     t = 5.0 * k + np.arange(100) / 20
    ...     watch.command(5.0 * k, volts)
    ...     watch.thrust(t, 0.4 * volts * abs(volts) + 0.5 * (t > 150) + rng.normal(0, 0.3, 100))
    ...     _ = watch.look()
    >>> watch.alarm.place, round(watch.alarm.began), 0.3 < watch.alarm.size < 0.7
    ('zero', 150, True)
    """

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.alarm: Alarm | None = None
        """Standing; its numbers are those of the newest look."""
        self.stretches = 0
        """Taken so far."""
        self.log_evidence = float("-inf")
        """log of the sum that raises the alarm at 0; stays at its largest."""
        self._cut = Stretches(settings.highest, settings.expected)
        self._commands: deque[tuple[float, float]] = deque()
        self._evidence = Evidence(
            laws(LEVELS if settings.expected is None else KNOWN_LEVELS), len(STATIC), len(SIGNATURES), BINS
        )
        self._loudness = Loudness()
        self._bus0 = float("nan")
        self._zero = self._slope = float("nan")
        self._first = self._before = float("nan")
        self._full = 0.0
        if settings.expected is not None:
            self._full = abs(settings.expected(settings.highest, float("nan"), 0.0, float("nan")))

    def command(self, time: float, volts: float) -> None:
        """From `time` (s) on; NaN: nothing is sent."""
        self._commands.append((time, volts))
        if len(self._commands) > MOST_WAITING:  # no thrust comes any more
            self._cut.command(*self._commands.popleft())

    def thrust(self, time: Floats, value: Floats) -> None:
        """Samples (n,) in s and N, in order. NaN and gaps are left out."""
        while self._commands and time.size and self._commands[0][0] <= time[-1]:
            before = int(np.searchsorted(time, self._commands[0][0], side="left"))
            self._cut.thrust(time[:before], value[:before])
            self._cut.command(*self._commands.popleft())
            time, value = time[before:], value[before:]
        self._cut.thrust(time, value)

    def bus_voltage(self, time: Floats, value: Floats) -> None:
        """V."""
        self._cut.bus.take(time, value)

    def flow_speed(self, time: Floats, value: Floats) -> None:
        """m/s."""
        self._cut.flow.take(time, value)

    def rotation_rate(self, time: Floats, value: Floats) -> None:
        """rev/s; used by a known model that is driven by it."""
        self._cut.rate.take(time, value)

    def look(self) -> Alarm | None:
        """The alarm when it is new, or when it has moved to another place; None otherwise."""
        said = None
        done, self._cut.done = self._cut.done, []
        for stretch in done:
            said = self._take(stretch) or said
        return said

    def _take(self, s: Stretch) -> Alarm | None:
        self._begin(s)
        value, static, candidates = self._row(s)
        evidence, prior = self._evidence, self._loudness.rest
        if self._full and prior > 0:  # what is known of the model, in units of the white noise
            std = np.array([np.inf, max(self.settings.model_std, KNOWN), *[KNOWN] * 3, *[np.inf] * 3]) * self._full
            evidence.prior = prior * BATCH / REFERENCE / std**2
        white = REFERENCE / s.used * self._loudness.take(s)
        level = level_of(s.volts / self.settings.highest, BINS) if s.slope == 0 and s.features[4] > 0 else None
        evidence.add((s.start + s.end) / 2, level, white, value, static, candidates)
        self._before = s.end
        self.stretches += 1
        found = evidence.posterior()
        if found is None:
            return None
        self.log_evidence = max(self.log_evidence, found.log_sum)
        if self.alarm is None and found.log_sum < 0:
            return None
        before, self.alarm = self.alarm, self._said(found, s.end)
        moved = before is not None and (before.place, before.from_start) != (self.alarm.place, self.alarm.from_start)
        return self.alarm if before is None or (moved and self.alarm.probability > 1 - LIKELY) else None

    def _begin(self, s: Stretch) -> None:
        """A change may have begun after the stretch before this one, or, with a known model, before the first."""
        rate = self.settings.false_alarms_per_hour
        if not self.stretches:
            self._first = s.start
            if self._full:
                self._evidence.begin(s.start, rate * FROM_START, kept=True)
        else:
            self._evidence.begin(self._before, rate * max(s.end - self._before, 1e-3) / 3600)
        if not isfinite(self._bus0):
            self._bus0 = s.bus

    def _row(self, s: Stretch) -> tuple[float, Floats, Floats]:
        x = s.features[0] if not self._full else s.expected / self._full
        row = signature_row(s, x, self._bus0)
        grown = ((s.start + s.end) / 2 - np.array(self._evidence.begun)) / RAMP
        candidates = np.where(RAMPS, row * grown[:, None], row)
        return s.thrust - (s.expected if self._full else self._rough(s)), static_row(s), candidates

    def _rough(self, s: Stretch) -> float:
        """A tare and a slope over v|v| from the first stretches. The evidence does not depend on them, for its static
        columns are free: they keep its sums of squares small, so that rounding does not count as noise.
        """
        x = s.features[0]
        if not isfinite(self._zero):
            self._zero = s.thrust if x == 0 else 0.0
        if not isfinite(self._slope) and x != 0:
            self._slope = (s.thrust - self._zero) / x
        return self._zero + (self._slope * x if x != 0 else 0.0)

    def _said(self, found: Posterior, now: float) -> Alarm:
        begun = np.array(self._evidence.begun)
        places = [place for _, place in SIGNATURES]
        by_place: dict[Place, float] = {p: float(found.weight[:, [q == p for q in places]].sum()) for p in places}
        best = max(by_place, key=lambda p: by_place[p])
        inside = np.where([p == best for p in places], found.weight, 0.0)
        j, g = np.unravel_index(int(np.argmax(inside)), inside.shape)
        when = inside.sum(axis=1) / inside.sum()
        order = np.argsort(begun)
        early, late = np.interp((0.05, 0.95), np.cumsum(when[order]), begun[order])
        grows = (now - begun[j]) / RAMP if RAMPS[g] else 1.0
        full = self._full or abs(float(found.static[STATIC.index("x")]) + self._slope)
        size, std = float(found.amplitude[j, g]) * grows, float(found.std[j, g]) * grows
        if best == "bus":  # as it is now: by how much the thrust at the highest command has changed with the bus
            size, std = size * self._bus_now(), std * abs(self._bus_now())
        hours = max(now - self._first, 1.0) / 3600 + (FROM_START if self._full else 0.0)
        return Alarm(
            time=now,
            began=float(begun[j]),
            began_from=float(min(early, begun[j])),
            began_to=float(max(late, begun[j])),
            place=best,
            probability=by_place[best],
            rivals=tuple(p for p, weight in by_place.items() if p != best and weight > LIKELY),
            size=size,
            size_std=std,
            share=size / full if full > 0 and best != "zero" and SIGNATURES[g][0] != "even step" else None,
            growing=bool(RAMPS[g]),
            e_value=exp(min(found.log_sum, 600.0)) / (self.settings.false_alarms_per_hour * hours),
            from_start=bool(self._full) and j == 0,
        )

    def _bus_now(self) -> float:
        """Change of the last bus voltage, in units of the bus signature."""
        last = self._cut.bus.last
        return BUS * (last / self._bus0 - 1.0) if isfinite(last) and self._bus0 > 0 else 0.0


@dataclass
class Loudness:
    """Fast noise of the stretches so far: at rest, and how it grows with the command."""

    rest: float = 0.0
    """N^2 of one batch."""
    _rests: int = 0
    _up: float = 0.0
    _down: float = 0.0

    def take(self, s: Stretch) -> float:
        """White variance of this stretch's samples over that at rest."""
        load = s.features[1] ** 2
        if s.features[4] == 0 and s.variance > 0:
            self._rests += 1
            self.rest += (s.variance - self.rest) / self._rests
        elif s.slope == 0 and self.rest > 0:
            self._up += load * (s.variance / self.rest - 1.0)
            self._down += load * load
        slope = max(self._up / self._down, 0.0) if self._down > 0 else 0.0
        return float(min(1.0 + slope * load, LOUDEST))
