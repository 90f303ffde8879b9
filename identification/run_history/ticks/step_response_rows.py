"""What the ticks of a moving command tell of fast dynamics, from samples far denser than the intervals of a history.

A ramp is a staircase: the console writes a new voltage every few hundredths of a second, and each write is a small step
of the thrust. Force samples that come at all phases of those ticks measure the response to a unit step at a finer
resolution than their own spacing, as an oscilloscope in equivalent-time sampling does:

    y(t) = sum over ticks m of C (V_m|V_m| - V_(m-1)|V_(m-1)|) s(t - t_m),   1 - s a straight line between B nodes

What the means over intervals can follow is taken out of both sides, so the rows made here are news beside them: the
normal equations of s in their principal axes, each with unit noise. A lag, a delay and a resonance that leave the same
means have different s.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.least_recently_used import LeastRecentlyUsed
from identification.run_history.ticks.beside_means import Samples

DENSE = 0.03
"""s between samples: where they are farther apart, hardly any share an interval."""
SPAN = 2.0
"""Ticks for which a response is followed; slower parts are in the means."""
LONGEST = 0.12
"""s of response."""
NODES = 60
EARLY = 16
"""Nodes in the first tenth, where lags and delays of a millisecond show."""
FINE = 400
"""Points at which a model's response is worked out."""
LEAST_TICKS = 50
REGULAR = 5.0
"""Median spacings after which a command no longer ticks."""
STEP = 0.02
USUAL = 2.0
LARGEST = 0.08
"""Shares of the largest driver, and median changes: a larger change is a step with fine intervals of its own..."""
AFTER_STEP = 0.3
"""...for so many seconds."""
CHUNK = 400
"""Intervals at a time: memory, and blocks for the colour of the noise."""
LEAST_POWER = 1e-6
"""Of a principal axis beside the largest."""
SHAPE = 0.01
"""Of a step: how far a response is known between nodes, and a static curve from level to level."""
GAIN_STD = 0.1
"""Relative: how far the slope of the static curve may be off C V|V| where the command ticks."""
IN_COMMON = 20.0
"""Stretches for which what all axes have in common counts, beside those of an axis itself: few tell little of one."""
MOST_KEPT = 1000
JUMP_STD = 0.3
"""Of a step: how far the line between two nodes may be off a jump between them."""
LEVELS = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Quantiles of |V| over the power of the ticks, for lags that depend on it."""


@dataclass(frozen=True, eq=False)
class TickRows:
    """Principal axes of the normal equations of one run."""

    design: Floats
    """(r, B + 1) of V|V| within the intervals: all at once, and what each node holds back; per sigma."""
    seen: Floats
    """(r,) the same of the thrust."""
    nodes: Floats
    """(B + 1,) s after a tick; at the last nothing is held back."""
    levels: Floats
    """(5,) |V| of the ticks."""
    kept: LeastRecentlyUsed[Floats] = field(default_factory=lambda: LeastRecentlyUsed[Floats](MOST_KEPT), repr=False)
    """Responses and rows worked out lately: most parameters of a model move none."""

    def predicted(self, C: float, held_back: Floats, jump: float = 0.0) -> Floats:
        """(r + 3,) rows for 1 - s = held_back (B,) at the nodes, and what was loose, in its own sigmas.

        Loose are the gain, and where s jumps at `jump` s its values at the nodes on either side: no straight line
        follows a jump.
        """
        shape = self.design[:, 0] - self.design[:, 1:] @ held_back
        columns = np.zeros((shape.size, 3))
        columns[:, 0] = shape
        if 0 < jump < self.nodes[-2]:
            k = int(np.searchsorted(self.nodes, jump, side="right"))  # column 0 is all at once
            columns[:, 1:] = self.design[:, k : k + 2]
        loose = np.array([GAIN_STD, JUMP_STD, JUMP_STD]) * (abs(C) or 1.0)
        middle = np.array([C, 0.0, 0.0])
        gram = columns.T @ columns + np.diag(1 / loose**2)
        found = np.linalg.solve(gram, columns.T @ self.seen + middle / loose**2)
        return np.concatenate([columns @ found, (found - middle) / loose])

    @property
    def resolution(self) -> float:
        """Seconds between the earliest nodes."""
        return float(self.nodes[1])

    @cached_property
    def after(self) -> Floats:
        """(FINE,) s, evenly up to the last node: where a model's response is worked out."""
        out: Floats = (np.arange(FINE) + 0.5) * (self.nodes[-1] / FINE)
        return out

    @cached_property
    def hats(self) -> Floats:
        """(B, FINE) weights that make values at `after` values at the nodes."""
        hats = np.array([np.interp(self.after, self.nodes, one) for one in np.eye(self.nodes.size)[:-1]])
        out: Floats = hats / hats.sum(axis=1)[:, None]
        return out

    @property
    def target(self) -> Floats:
        return np.concatenate([self.seen, np.zeros(3)])


def tick_rows(history: History) -> TickRows | None:
    """The rows of a run; None where its samples are not dense, or its command does not tick."""
    if history.ticks is None or history.spacing > DENSE or history.sample_time.size < 1000:
        return None
    at, value = history.ticks
    change = np.diff(value * np.abs(value), prepend=0.0)
    new = np.abs(np.diff(value, prepend=0.0)) > 1e-9 * history.size
    at, value, change = at[new], value[new], change[new]
    moved = np.abs(np.diff(value, prepend=0.0))
    small = moved < np.clip(USUAL * float(np.median(moved)), STEP * history.size, LARGEST * history.size)
    if np.count_nonzero(small) < LEAST_TICKS:
        return None
    spacing = float(np.median(np.diff(at)))
    nodes = _nodes(min(SPAN * spacing, LONGEST))
    used = _ticking(history, at, at[~small], REGULAR * spacing)
    parts = list(_normal(history, at, change, nodes, used))
    if len(parts) < 4:
        return None
    return _axes(parts, nodes, _levels(value[small], change[small]))


def _nodes(longest: float) -> Floats:
    early = np.linspace(0.0, 0.1 * longest, EARLY, endpoint=False)
    return np.concatenate([early, np.linspace(0.1 * longest, longest, NODES - EARLY + 1)])


def _ticking(history: History, at: Floats, steps: Floats, longest: float) -> NDArray[np.bool_]:
    """(M,) intervals of at least two samples in which the command ticks on, away from its steps."""
    begin = history.edges[:-1]
    last = np.searchsorted(at, begin, side="right") - 1
    ticks = (last >= 0) & (begin - at[np.maximum(last, 0)] < longest)
    stepped = np.searchsorted(steps, history.edges[1:], side="right") - 1
    clear = (stepped < 0) | (begin - steps[np.maximum(stepped, 0)] > AFTER_STEP if steps.size else True)
    return np.asarray((history.count > 1) & ticks & clear, dtype=np.bool_)


def _normal(
    history: History, at: Floats, change: Floats, nodes: Floats, used: NDArray[np.bool_]
) -> Iterator[tuple[Floats, Floats, float, int]]:
    """(gram, moment, square of the thrust, samples beyond the means taken out) of each stretch of CHUNK intervals."""
    index = np.clip(np.searchsorted(history.edges, history.sample_time, side="right") - 1, 0, used.size - 1)
    total = np.concatenate([[0.0], np.cumsum(change)])
    for first in range(0, used.size, CHUNK):
        if not used[first : first + CHUNK].any():
            continue
        # one interval more on either side for the lines through means
        begin, end = np.searchsorted(index, [first - 1, first + CHUNK + 1])
        t, j = history.sample_time[begin:end], index[begin:end]
        if t.size < 3:
            continue
        last = np.searchsorted(at, t, side="right") - 1
        levels = np.column_stack([history.sample_thrust[begin:end], total[last + 1]])
        here = np.arange(j[0], j[-1] + 1)
        kept = used[here] & (here >= first) & (here < first + CHUNK)
        samples = int(np.count_nonzero(kept[j - j[0]]))
        if samples > NODES:
            gram = Samples(t, j - j[0]).gram(levels, _held_back(t, last, at, change, nodes), kept)
            yield gram[1:, 1:], gram[1:, 0], float(gram[0, 0]), samples - int(np.count_nonzero(kept))


def _held_back(t: Floats, last: NDArray[np.intp], at: Floats, change: Floats, nodes: Floats) -> csr_array:
    """(n, B) what each node holds back, at samples `t` (n,), of the ticks `change` (T,) at `at`; `last` (n,) is the
    tick before each."""
    shares, columns = [], []
    for back in range(NODES):
        tick = np.maximum(last - back, 0)
        since = t - at[tick]
        near = (last >= back) & (since < nodes[-1])
        if back and not near.any():
            break
        i = np.clip(np.searchsorted(nodes, since, side="right") - 1, 0, NODES - 1)
        share = (since - nodes[i]) / (nodes[i + 1] - nodes[i])
        held = np.where(near, change[tick], 0.0)
        shares += [(1 - share) * held, share * held]
        columns += [i, i + 1]
    rows = np.arange(t.size + 1) * len(shares)
    every = csr_array((np.array(shares).T.ravel(), np.array(columns).T.ravel(), rows), shape=(t.size, NODES + 1))
    return every[:, :-1]  # at the last node nothing is held back


def _axes(parts: list[tuple[Floats, Floats, float, int]], nodes: Floats, levels: Floats) -> TickRows | None:
    """Rows of unit noise, whose colour the scatter between stretches tells."""
    gram = np.sum([p[0] for p in parts], axis=0)
    moment = np.sum([p[1] for p in parts], axis=0)
    power, axis = np.linalg.eigh(gram)
    kept = power > LEAST_POWER * power[-1]
    if power[-1] <= 0:
        return None
    power, axis = power[kept], axis[:, kept]
    response = axis @ ((axis.T @ moment) / power)
    freedom = sum(p[3] for p in parts) - power.size
    left = sum(p[2] for p in parts) - float(moment @ response)
    if freedom <= 0 or left <= 0:
        return None
    variance = left / freedom
    scores = np.array([(axis.T @ (p[1] - p[0] @ response)) / np.sqrt(power) for p in parts])
    each = np.sum(scores**2, axis=0) / variance * len(parts) / (len(parts) - 1)
    colour = np.maximum((IN_COMMON * float(np.mean(each)) + len(parts) * each) / (IN_COMMON + len(parts)), 1.0)
    seen = (axis.T @ moment) / np.sqrt(power * variance * colour)
    design = np.sqrt(power / (variance * colour))[:, None] * axis.T
    gain = float(response[0])
    quieter = 1 / np.sqrt(1 + (SHAPE * gain) ** 2 * np.sum(design**2, axis=1))
    return TickRows(quieter[:, None] * design, quieter * seen, nodes, levels)


def _levels(value: Floats, change: Floats) -> Floats:
    size = np.abs(value)
    order = np.argsort(size)
    total = np.cumsum(change[order] ** 2)
    at = np.searchsorted(total, np.array(LEVELS) * total[-1])
    return np.asarray(size[order][np.minimum(at, size.size - 1)], dtype=np.float64)
