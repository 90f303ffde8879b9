"""What the ticks of a moving command tell of fast dynamics, from samples far denser than the intervals of a history.

A ramp is a staircase: the console writes a new voltage every few hundredths of a second, and each write is a small step
of the thrust. Force samples that come at all phases of those ticks measure the response to a unit step at a finer
resolution than their own spacing, as an oscilloscope in equivalent-time sampling does:

    y(t) = sum over ticks m of C (V_m|V_m| - V_(m-1)|V_(m-1)|) s(t - t_m),   s constant in each of B narrow bins

What the means over intervals can follow is taken out of both sides, so the rows made here are news beside them: the
normal equations of s in their principal axes, each with unit noise. A lag, a delay and a resonance that leave the same
means have different s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

if TYPE_CHECKING:
    from identification.physics.history import History

DENSE = 0.008
"""s between samples: where they are farther apart, each has an interval of its own after a tick."""
SPAN = 3.0
"""Ticks after which the response to one is complete; slower parts are in the means."""
LONGEST = 0.15
"""s of response."""
BINS = 60
LEAST_TICKS = 50
REGULAR = 5.0
"""Median spacings after which a command no longer ticks."""
STEP = 0.02
"""Share of the largest driver: a larger change is a step, which has fine intervals of its own..."""
AFTER_STEP = 0.3
"""...for so many seconds."""
CHUNK = 400
"""Intervals at a time: memory, and blocks for the colour of the noise."""
LEAST_POWER = 1e-6
"""Of a principal axis beside the largest."""
LOUDEST = 50.0
"""Sigma of a row: no static curve is known better than to one part in fifty here."""
GAIN_STD = 0.1
"""Relative: how far the slope of the static curve may be off C V|V| where the command ticks."""
LEVELS = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Quantiles of |V| over the power of the ticks, for lags that depend on it."""


@dataclass(frozen=True, eq=False)
class TickRows:
    """Principal axes of the normal equations of one run."""

    design: Floats
    """(r, B + 1) of V|V| within the intervals: all at once, and what each bin holds back; per sigma."""
    seen: Floats
    """(r,) the same of the thrust."""
    width: float
    """s of a bin."""
    levels: Floats
    """(5,) |V| of the ticks."""

    def predicted(self, C: float, held_back: Floats) -> Floats:
        """(r + 1,) rows for 1 - s = held_back (B,), and how far the gain had to leave C, in its sigmas."""
        shape = self.design @ np.concatenate([[1.0], -held_back])
        loose = GAIN_STD * abs(C) or 1.0
        gain = (float(shape @ self.seen) + C / loose**2) / (float(shape @ shape) + 1 / loose**2)
        return np.append(gain * shape, (gain - C) / loose)

    @property
    def target(self) -> Floats:
        return np.append(self.seen, 0.0)


def tick_rows(history: History) -> TickRows | None:
    """The rows of a run; None where its samples are not dense, or its command does not tick."""
    if history.ticks is None or history.spacing > DENSE or history.sample_time.size < 1000:
        return None
    at, value = history.ticks
    change = np.diff(value * np.abs(value), prepend=0.0)
    new = np.abs(np.diff(value, prepend=0.0)) > 1e-9 * history.size
    at, value, change = at[new], value[new], change[new]
    small = np.abs(np.diff(value, prepend=0.0)) < STEP * history.size
    if np.count_nonzero(small) < LEAST_TICKS:
        return None
    spacing = float(np.median(np.diff(at)))
    width = min(SPAN * spacing, LONGEST) / BINS
    used = _ticking(history, at, at[~small], REGULAR * spacing)
    parts = list(_normal(history, at, change, width, used))
    if len(parts) < 4:
        return None
    return _axes(parts, width, _levels(value[small], change[small]))


def _ticking(history: History, at: Floats, steps: Floats, longest: float) -> NDArray[np.bool_]:
    """(M,) intervals of at least two samples in which the command ticks on, away from its steps."""
    begin = history.edges[:-1]
    last = np.searchsorted(at, begin, side="right") - 1
    ticks = (last >= 0) & (begin - at[np.maximum(last, 0)] < longest)
    stepped = np.searchsorted(steps, history.edges[1:], side="right") - 1
    clear = (stepped < 0) | (begin - steps[np.maximum(stepped, 0)] > AFTER_STEP if steps.size else True)
    return np.asarray((history.count > 1) & ticks & clear, dtype=np.bool_)


def _normal(
    history: History, at: Floats, change: Floats, width: float, used: NDArray[np.bool_]
) -> Iterator[tuple[Floats, Floats, float, int]]:
    """(gram, moment, square of the thrust, samples) of each stretch of CHUNK intervals."""
    index = np.clip(np.searchsorted(history.edges, history.sample_time, side="right") - 1, 0, used.size - 1)
    total = np.cumsum(change)
    for first in range(0, used.size, CHUNK):
        if not used[first : first + CHUNK].any():
            continue
        # one interval more on either side for the lines through means
        begin, end = np.searchsorted(index, [first - 1, first + CHUNK + 1])
        t, j = history.sample_time[begin:end], index[begin:end]
        if t.size < 3:
            continue
        last = np.searchsorted(at, t, side="right") - 1
        columns = np.zeros((t.size, BINS + 2))
        columns[:, 0] = history.sample_thrust[begin:end]
        columns[:, 1] = np.where(last >= 0, total[np.maximum(last, 0)], 0.0)
        rows = np.arange(t.size)
        for back in range(BINS):
            tick = last - back
            bin_of = np.floor((t - at[np.maximum(tick, 0)]) / width).astype(np.intp)
            near = (tick >= 0) & (bin_of < BINS)
            if not near.any():
                break
            columns[rows[near], 2 + bin_of[near]] += change[tick[near]]
        kept = used[j] & (j >= first) & (j < first + CHUNK)
        news = _beside_means(columns, t, j)[kept]
        if news.shape[0] > BINS:
            X, y = news[:, 1:], news[:, 0]
            yield X.T @ X, X.T @ y, float(y @ y), int(y.size)


def _beside_means(columns: Floats, t: Floats, j: NDArray[np.intp]) -> Floats:
    """Columns less the means over their intervals and the lines through the neighbours' means."""
    here = j - j[0]
    count = np.maximum(np.bincount(here), 1)
    size = count.size
    ends = np.concatenate([[0], np.cumsum(np.bincount(here))])
    running = np.concatenate([np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)])
    mean = (running[ends[1:]] - running[ends[:-1]]) / count[:, None]
    when = np.bincount(here, weights=t) / count
    slope = np.zeros_like(mean)
    filled = np.diff(ends) > 0
    inner = np.flatnonzero(filled[2:] & filled[:-2]) + 1 if size > 2 else np.empty(0, dtype=np.intp)
    slope[inner] = (mean[inner + 1] - mean[inner - 1]) / (when[inner + 1] - when[inner - 1])[:, None]
    out: Floats = columns - mean[here] - slope[here] * (t - when[here])[:, None]
    return out


def _axes(parts: list[tuple[Floats, Floats, float, int]], width: float, levels: Floats) -> TickRows | None:
    """Rows of unit noise, whose colour the scatter between stretches tells."""
    gram = np.sum([p[0] for p in parts], axis=0)
    moment = np.sum([p[1] for p in parts], axis=0)
    power, axis = np.linalg.eigh(gram)
    kept = power > LEAST_POWER * power[-1]
    if power[-1] <= 0:
        return None
    power, axis = power[kept], axis[:, kept]
    response = axis @ ((axis.T @ moment) / power)
    samples = sum(p[3] for p in parts)
    left = sum(p[2] for p in parts) - float(moment @ response)
    variance = left / max(samples - power.size, 1)
    if variance <= 0:
        return None
    scores = np.array([(axis.T @ (p[1] - p[0] @ response)) / np.sqrt(power) for p in parts])
    colour = np.maximum(np.sum(scores**2, axis=0) / variance * len(parts) / (len(parts) - 1), 1.0)
    seen = (axis.T @ moment) / np.sqrt(power * variance * colour)
    quieter = 1 / np.sqrt(1 + (seen / LOUDEST) ** 2)
    design = np.sqrt(power / (variance * colour))[:, None] * axis.T
    return TickRows(quieter[:, None] * design, quieter * seen, width, levels)


def _levels(value: Floats, change: Floats) -> Floats:
    size = np.abs(value)
    order = np.argsort(size)
    total = np.cumsum(change[order] ** 2)
    at = np.searchsorted(total, np.array(LEVELS) * total[-1])
    return np.asarray(size[order][np.minimum(at, size.size - 1)], dtype=np.float64)
