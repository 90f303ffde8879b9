"""Intervals of one run: short where the command changes, growing with the time since then, cut at its steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.prepare.measured_driver import measured
from identification.recording import Channel, Floats

FINEST = 0.01
"""s, the shortest interval."""
COARSEST = 0.25
"""s, the longest one while levels are held."""
FINEST_AFTER_STEP = 0.0025
"""s: motor lags of some milliseconds are as steep as this."""
GROWTH_AFTER_STEP = 0.12
"""Length of an interval per time since a step: finer than GROWTH where all dynamics are."""
WINDOW = 0.0015
"""s before and after a sample that stands for its time."""
WINDOW_ZONE = 0.1
"""s after a change of the command in which samples have windows."""
BEFORE_STEP = 2.0
"""Spacings of the samples: so long, and by how much the force comes before it, they have windows before a step too."""
LEAST_WINDOWED = 0.008
"""s between samples: where they are denser, only those after a step have windows..."""
DENSE_ZONE = 10.0
"""...for so many samples."""
WINDOW_SHARE = 0.3
"""Of the spacing, at most, before and after a sample."""
WINDOWED = 0.4
"""Of the intervals: samples on ramps that have windows, at most; each takes two. Where there are more the ticks are
edges, and cut the intervals of the samples beside them."""
ON_RAMP = 2.0
"""Spacings of the samples: ticks closer than this to each other are a ramp, on which an interval goes from one to the
next. A command stands still in it."""
GROWTH = 0.06
"""Length of an interval per time since the last change."""
MOVES = 0.01
"""Share of the largest driver that counts as a change."""
GAP = 5.0
"""Spacings without a sample that are a gap."""
TICKING = 5
"""More steps than this part of the intervals are the ticks of ramps, unless they are..."""
LARGEST_TICK = 0.08
"""...larger than this share of the largest driver."""
REST = 3.0
"""Spacings of the samples: a command that stood for longer was held."""


def distinct(time: Floats, value: Floats) -> tuple[Floats, Floats]:
    """Samples that share one time become their mean."""
    if time.size < 2 or np.all(np.diff(time) > 0):
        return time, value
    unique, index = np.unique(time, return_inverse=True)
    mean: Floats = np.bincount(index, weights=value) / np.bincount(index)
    return unique, mean


def _gaps(time: Floats, good: NDArray[np.bool_]) -> Floats:
    """(g, 2) first and one past last time of each stretch that is not good, between two that are."""
    change = np.diff(good.astype(np.int8))
    begun, ended = np.flatnonzero(change == -1) + 1, np.flatnonzero(change == 1) + 1
    ended = ended[ended > begun[0]] if begun.size else ended[:0]
    return np.column_stack([time[begun[: ended.size]], time[ended]]).astype(np.float64)


class Held:
    """The driver as a function of time: constant between rows of a command, a straight line between measurements.

    A measurement that jumped from one sample to the next did so half way between them.
    """

    def __init__(self, channel: Channel, end: float) -> None:
        good = np.isfinite(channel.value)
        self.quantity = str(channel.quantity)
        self.stepwise = channel.quantity == "command_voltage"
        self.unknown = _gaps(channel.time, good) if self.stepwise else np.empty((0, 2))
        """(g, 2) s: from a command that is no number to the next that is one; taken as that one."""
        known = channel.time.astype(np.float64)
        for begun, ended in self.unknown:
            known[channel.time == ended] = begun
        self.time, self.value = distinct(known[good], channel.value[good])
        self.measured = None if self.stepwise else measured(self.time, self.value)
        if self.measured is not None:
            self.time, self.value = self.measured.with_jumps()
        last = max(end, float(self.time[-1]))
        knots = np.append(self.time, last + 1.0)
        if self.stepwise:
            area = self.value * np.diff(knots)
        else:
            padded = np.append(self.value, self.value[-1])
            area = 0.5 * (padded[1:] + padded[:-1]) * np.diff(knots)
        self._knots, self._area = knots, np.concatenate([[0.0], np.cumsum(area)])

    def mean(self, edges: Floats) -> Floats:
        """(M,) mean over each interval. A command before its first row is 0."""
        total = np.interp(edges, self._knots, self._area)
        if not self.stepwise:
            index = np.clip(np.searchsorted(self._knots, edges, side="right") - 1, 0, self.time.size - 1)
            padded = np.append(self.value, self.value[-1])
            span = self._knots[index + 1] - self._knots[index]
            part = np.clip(edges - self._knots[index], 0.0, span)
            slope = (padded[index + 1] - padded[index]) / span
            total = self._area[index] + padded[index] * part + 0.5 * slope * part**2
        out: Floats = np.diff(total) / np.diff(edges)
        return out

    def excess(self, edges: Floats) -> Floats:
        """(M,) mean of V|V| over each interval less that of the mean V: what a moving driver gives beside its mean."""
        at = np.union1d(edges, self._knots[(self._knots > edges[0]) & (self._knots < edges[-1])])
        middle, left, right = 0.5 * (at[1:] + at[:-1]), at[:-1], at[1:]
        if self.stepwise:
            index = np.searchsorted(self._knots, middle, side="right") - 1
            v = np.where(index < 0, 0.0, self.value[np.clip(index, 0, self.time.size - 1)])
            square = v * np.abs(v)
        else:
            a, m, b = (np.interp(t, self.time, self.value) for t in (left, middle, right))
            square = (a * np.abs(a) + 4 * m * np.abs(m) + b * np.abs(b)) / 6
        which = np.searchsorted(edges, middle, side="right") - 1
        total = np.bincount(which, weights=square * (right - left), minlength=edges.size - 1)
        mean = self.mean(edges)
        out: Floats = total / np.diff(edges) - mean * np.abs(mean)
        return out

    @property
    def noise(self) -> float:
        """Standard deviation of a sample of a measured driver, in its unit; 0 of a command."""
        return 0.0 if self.measured is None else self.measured.noise

    @property
    def finest(self) -> float:
        """s: between samples of a measured driver whose noise is seen; 0 of all others."""
        loud = self.measured is not None and self.measured.loud
        return float(np.median(np.diff(self.measured.time))) if self.measured and loud else 0.0

    def starts(self, rest: float) -> Floats:
        """Times at which it begins to move, and not by a step, after it stood for more than `rest` s."""
        change = np.diff(self.value)
        moves, far = self.time[1:][change != 0], np.abs(change[change != 0])
        begins = (np.diff(moves, prepend=-np.inf) > rest) & (
            far <= policy.prepare.COMMAND_STEP * float(np.max(np.abs(self.value)))
        )
        out: Floats = moves[begins]
        return out

    def changes(self) -> Floats:
        """Times at which it has moved by MOVES of its size since the last such time."""
        step = max(MOVES * float(np.max(np.abs(self.value))), policy.prepare.DRIVER_NOISE_SIGMA * self.noise)
        index, last = [0], self.value[0]
        if self.value.size < 200_000:
            for i, v in enumerate(self.value.tolist()):
                if abs(v - last) > step:
                    index.append(i)
                    last = v
        out: Floats = self.time[np.array(index, dtype=np.intp)]
        return out


def edges_of(time: Floats, held: Held, most: int, early: float = 0.0) -> Floats:
    """Edges between samples, dense after changes; big steps of the command are edges too. `early`: s by which the force
    comes before its command; more than 0: dense before steps as well."""
    spacing = float(np.median(np.diff(time)))
    between = 0.5 * (time[1:] + time[:-1])
    candidates = np.concatenate([[time[0] - 0.5 * spacing], between, [time[-1] + 0.5 * spacing]])
    changes = held.changes()
    index = np.searchsorted(changes, candidates, side="right") - 1
    since = np.where(index >= 0, candidates - changes[np.maximum(index, 0)], COARSEST / GROWTH)
    finest = max(FINEST, spacing, held.finest)
    width = np.clip(GROWTH * since, finest, max(COARSEST, finest))
    wanted = np.concatenate([[0.0], np.cumsum(np.diff(candidates) / width[1:])])
    shrink = min(1.0, most / max(float(wanted[-1]), 1.0))
    number = np.floor(wanted * shrink + 1e-6)
    edges = candidates[np.concatenate([[True], np.diff(number) > 0])]
    edges[-1] = candidates[-1]
    gap = np.flatnonzero(np.diff(time) > GAP * spacing)
    if 0 < gap.size < most // 4:  # samples at the end of a long interval would stand for its middle
        edges = np.union1d(edges, np.concatenate([time[gap] + 0.5 * spacing, time[gap + 1] - 0.5 * spacing]))
    edges = _with_starts(_with_jumps(edges, held, most), candidates, held, spacing, most)
    edges = _with_windows(_with_steps(edges, held, spacing, most), time, held, spacing, most)
    if not (early and held.stepwise):
        return edges
    steps = _changes(held, edges, policy.prepare.COMMAND_STEP)
    return _cut_by_windows(edges, _shortly_before(steps, time, early + BEFORE_STEP * spacing), steps, spacing, most)


def _with_jumps(edges: Floats, held: Held, most: int) -> Floats:
    """Two levels of a measured driver share no interval."""
    jumps = held.measured.jumps if held.measured is not None else np.empty(0)
    inside = jumps[(jumps > edges[0]) & (jumps < edges[-1])]
    if not 0 < inside.size < most // 4:
        return edges
    out = np.union1d(edges, inside)
    result: Floats = out[np.concatenate([[True], np.diff(out) > 1e-6])]
    return result


def _with_starts(edges: Floats, candidates: Floats, held: Held, spacing: float, most: int) -> Floats:
    """What is held and what moves after it share no interval: an edge before the first sample on the way."""
    starts = held.starts(REST * spacing) if held.stepwise else np.empty(0)
    if not 0 < starts.size < most // 4:
        return edges
    before = np.searchsorted(candidates, starts, side="right") - 1
    return np.union1d(edges, candidates[np.clip(before, 0, candidates.size - 1)])


def _with_steps(edges: Floats, held: Held, spacing: float, most: int) -> Floats:
    """Each step of a command is an edge, followed by intervals that begin at FINEST_AFTER_STEP and grow."""
    size = float(np.max(np.abs(held.value)))
    steps = held.time[1:][np.abs(np.diff(held.value)) > policy.prepare.COMMAND_STEP * size]
    steps = steps[(steps > edges[0]) & (steps < edges[-1])]
    if steps.size > most // TICKING:  # a fast ramp, of which each tick would be a step
        steps = held.time[1:][np.abs(np.diff(held.value)) > LARGEST_TICK * size]
        steps = steps[(steps > edges[0]) & (steps < edges[-1])]
    if not (held.stepwise and steps.size):
        return edges
    after = [0.0]
    while (width := max(FINEST_AFTER_STEP, GROWTH_AFTER_STEP * after[-1])) < spacing:
        after.append(after[-1] + width)
    if steps.size * len(after) > most:
        after = [0.0]
    gap = np.diff(np.append(steps, edges[-1]))
    added = (steps[:, None] + np.array(after)[None, :])[np.array(after)[None, :] < gap[:, None] - 1e-4]
    last = np.searchsorted(steps, edges, side="right") - 1
    since = np.where(last >= 0, edges - steps[np.maximum(last, 0)], np.inf)
    until = np.where(last + 1 < steps.size, steps[np.minimum(last + 1, steps.size - 1)] - edges, np.inf)
    free = (since > after[-1] + 0.3 * spacing) & (until > min(0.3 * spacing, FINEST_AFTER_STEP))
    free[[0, -1]] = True
    out = np.union1d(edges[free], added)
    result: Floats = out[np.concatenate([[True], np.diff(out) > 1e-6])]
    return result


def _changes(held: Held, edges: Floats, least: float) -> Floats:
    """Times within the run at which a command changes by more than this share of its size."""
    found = held.time[1:][np.abs(np.diff(held.value)) > least * float(np.max(np.abs(held.value)))]
    out: Floats = found[(found > edges[0]) & (found < edges[-1])]
    return out


def _shortly_after(changes: Floats, time: Floats, zone: float) -> Floats:
    """Those of the samples that come within `zone` s after one of the changes."""
    if not changes.size:
        return changes
    last = np.searchsorted(changes, time, side="right") - 1
    out: Floats = time[(last >= 0) & (time - changes[np.maximum(last, 0)] < zone)]
    return out


def _shortly_before(changes: Floats, time: Floats, zone: float) -> Floats:
    """Those of the samples after which one of the changes comes within `zone` s."""
    if not changes.size:
        return changes
    following = np.searchsorted(changes, time, side="right")
    until = changes[np.minimum(following, changes.size - 1)] - time
    out: Floats = time[(following < changes.size) & (until < zone)]
    return out


def _from_tick_to_tick(edges: Floats, ticks: Floats, apart: float) -> Floats:
    """Ticks as edges; of the edges before, those that lie between ticks less than `apart` s from each other go."""
    before = np.searchsorted(ticks, edges, side="right") - 1
    close = np.append(np.diff(ticks) < apart, False)
    free = (before < 0) | ~close[np.maximum(before, 0)]
    free[[0, -1]] = True
    return np.union1d(edges[free], ticks)


def _with_windows(edges: Floats, time: Floats, held: Held, spacing: float, most: int) -> Floats:
    """Every change of a command is an edge, and shortly after it each sample gets a short interval of its own: after
    steps alone where samples are dense, or many are on ramps."""
    if not held.stepwise:
        return edges
    dense = spacing < LEAST_WINDOWED
    zone = DENSE_ZONE * spacing if dense else max(WINDOW_ZONE, 5 * spacing)
    changes = _changes(held, edges, policy.prepare.COMMAND_STEP if dense else 0.0)
    if not changes.size or changes.size > most:
        return edges
    own = _shortly_after(changes, time, zone)
    if own.size > WINDOWED * most and not dense:
        edges = _from_tick_to_tick(edges, changes, ON_RAMP * spacing)
        changes = _changes(held, edges, LARGEST_TICK)
        own = _shortly_after(changes, time, zone)
    return _cut_by_windows(edges, own, changes, spacing, most)


def _cut_by_windows(edges: Floats, own: Floats, changes: Floats, spacing: float, most: int) -> Floats:
    """The changes as edges, and a short interval about each of the samples `own`, cut where a change is."""
    half = min(WINDOW, WINDOW_SHARE * spacing)
    if own.size > most:
        return edges
    if not own.size:
        return np.asarray(np.union1d(edges, changes), dtype=np.float64)
    nearest = np.searchsorted(changes, own)
    before = changes[np.maximum(nearest - 1, 0)]
    after = changes[np.minimum(nearest, changes.size - 1)]
    low = np.where((before <= own) & (own - before < half), before, own - half)
    high = np.where((after > own) & (after - own < half), after, own + half)
    windows = np.column_stack([low, high])
    inside = np.searchsorted(windows[:, 0], edges, side="right") - 1
    covered = (inside >= 0) & (edges > windows[np.maximum(inside, 0), 0]) & (edges < windows[np.maximum(inside, 0), 1])
    covered[[0, -1]] = False
    out = np.union1d(np.union1d(edges[~covered], windows.ravel()), changes)
    out = out[(out >= edges[0]) & (out <= edges[-1])]
    result: Floats = out[np.concatenate([[True], np.diff(out) > 1e-5])]
    return result
