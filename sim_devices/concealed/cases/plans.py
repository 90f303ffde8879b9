"""Command profiles: what an operator would run, drawn at random. Rows of changes and the steps they belong to."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rng = np.random.Generator

KINDS = ("staircase", "interleaved", "random", "ramp", "sine", "mixed")


@dataclass(frozen=True, slots=True)
class Step:
    """One step as it was run: phases of the recording format."""

    phase: str
    volts: float
    start: float
    end: float


@dataclass(frozen=True, eq=False, slots=True)
class Profile:
    """`time` (n,) s and `volts` (n,) V of changes, each holding until the next; `steps` in order; `duration` s."""

    kind: str
    time: Floats
    volts: Floats
    steps: tuple[Step, ...]
    duration: float


class Writer:
    """Rows and steps as they are laid down, each half a grid step before the grid point that first knows it.

    So no sample is ever taken at the very instant of a change.
    """

    def __init__(self, tick: float, slew: float, dt: float) -> None:
        self._points = max(round(tick / dt), 1)
        self._dt, self._tick, self._slew = dt, self._points * dt, slew
        self._now, self._at = 0, 0.0
        self._rows: list[tuple[float, float]] = [(0.0, 0.0)]
        self._steps: list[Step] = []

    @property
    def t(self) -> float:
        return max(self._now - 0.5, 0.0) * self._dt

    @property
    def tick(self) -> float:
        """S between two commands."""
        return self._tick

    def hold(self, volts: float, seconds: float, phase: str = "hold") -> None:
        """Go to `volts` at the slew rate (0: at once), then stay for `seconds`."""
        volts = round(volts, 3)
        if self._slew and volts != self._at:
            start, first = self.t, self._at
            count = int(np.ceil(abs(volts - first) / (self._slew * self._tick)))
            for i in range(1, count + 1):
                self._set(round(first + (volts - first) * i / count, 3))
                self._now += self._points
            self._steps.append(Step("ramp", volts, start, self.t))
        self._set(volts)
        self._stay(seconds, phase, volts)

    def follow(self, values: Floats, phase: str) -> None:
        """One value a tick."""
        start = self.t
        for value in values.tolist():
            self._set(round(value, 3))
            self._now += self._points
        self._steps.append(Step(phase, float(values[-1]), start, self.t))

    def _stay(self, seconds: float, phase: str, volts: float) -> None:
        ticks = max(round(seconds / self._tick), 1)
        start = self.t
        self._now += ticks * self._points
        self._steps.append(Step(phase, volts, start, self.t))

    def _set(self, volts: float) -> None:
        if volts != self._rows[-1][1]:
            self._rows.append((self.t, volts))
            self._at = volts

    def profile(self, kind: str) -> Profile:
        rows = np.array(self._rows, dtype=np.float64)
        return Profile(kind, rows[:, 0], rows[:, 1], tuple(self._steps), self.t)


def profile(kind: str, top: float, duration: float, dt: float, rng: Rng, *, smooth: bool = False) -> Profile:
    """About `duration` s of a plan of `kind`, within +-`top` V, on a grid of `dt` s; `smooth`: always slewed.

    Raises ValueError for an unknown kind.
    """
    if kind not in KINDS:
        raise ValueError(f"plan must be one of {', '.join(KINDS)}, got {kind!r}")
    tick = 1.0 / float(rng.choice((20.0, 25.0, 50.0, 100.0)))
    slew = 0.0 if rng.random() < 0.5 and not smooth else top / float(rng.uniform(0.3, 3.0))
    w = Writer(tick, slew, dt)
    w.hold(0.0, float(rng.uniform(3.0, 10.0)), "tare")
    parts = [kind] if kind != "mixed" else [str(p) for p in rng.permutation(KINDS[:-1])[:3]]
    for i, part in enumerate(parts):
        _lay(w, part, top, w.t + (duration - 5.0 - w.t) / (len(parts) - i), rng)
    w.hold(0.0, float(rng.uniform(3.0, 8.0)), "rest")
    return w.profile(kind)


def _lay(w: Writer, part: str, top: float, end: float, rng: Rng) -> None:
    match part:
        case "staircase":
            _levels(w, _staircase(top, rng), end)
        case "interleaved":
            _interleaved(w, top, end, rng)
        case "random":
            _random(w, top, end, rng)
        case "ramp":
            _waves(w, end, top, rng, "free")
        case _:
            _waves(w, end, top, rng, "sine")


def _staircase(top: float, rng: Rng) -> Floats:
    """0, up to +top, down through 0 to -top, back to 0."""
    up = np.linspace(0.0, top, int(rng.integers(7, 13)))
    return np.concatenate([up[1:], up[-2::-1], -up[1:], -up[-2::-1]])


def _levels(w: Writer, levels: Floats, end: float) -> None:
    """All the levels in the time that is there; again from the start when holds would last longer than 12 s."""
    rounds = max(int(np.ceil((end - w.t) / (12.0 * levels.size))), 1)
    dwell = max((end - w.t) / (rounds * levels.size), 1.0)
    for volts in np.tile(levels, rounds).tolist():
        w.hold(volts, dwell, "hold" if volts else "rest")


def _interleaved(w: Writer, top: float, end: float, rng: Rng) -> None:
    """Levels of both signs in turn, a zero return every few holds."""
    count, every, dwell = int(rng.integers(5, 11)), int(rng.integers(2, 6)), float(rng.uniform(3.0, 8.0))
    sizes = np.linspace(top / count, top, count)
    done = 0
    while w.t < end:
        for size in rng.permutation(sizes).tolist():
            for volts in (size, -size):
                w.hold(volts, dwell)
                done += 1
                if done % every == 0:
                    w.hold(0.0, float(rng.uniform(2.0, 8.0)), "rest")
            if w.t >= end:
                return


def _random(w: Writer, top: float, end: float, rng: Rng) -> None:
    dwell = float(rng.uniform(2.0, 6.0))
    while w.t < end:
        w.hold(float(rng.uniform(-top, top)), dwell * float(rng.uniform(0.5, 1.5)))
        if rng.random() < 0.15:
            w.hold(0.0, float(rng.uniform(4.0, 15.0)), "rest")


def _waves(w: Writer, end: float, top: float, rng: Rng, phase: str) -> None:
    """Triangles (`free`) or sines of several sizes and periods, a rest between."""
    while w.t < end:
        period, size = float(rng.uniform(8.0, 50.0)), top * float(rng.uniform(0.3, 1.0))
        size = top if w.t + 2 * period > end else size
        turn = np.arange(int(int(rng.integers(1, 4)) * period / w.tick)) * w.tick / period
        wave = np.sin(2 * pi * turn) if phase == "sine" else 2 / pi * np.arcsin(np.sin(2 * pi * turn))
        w.follow(size * wave, phase)
        w.hold(0.0, float(rng.uniform(2.0, 8.0)), "rest")


def held(time: Floats, values: Floats, at: Floats) -> Floats:
    """Zero-order hold of rows of changes at each time of `at` (ascending); the first value before the first row."""
    first = np.searchsorted(at, time, side="left")
    first[0] = 0
    return np.repeat(values, np.diff(np.append(first, at.size)))
