"""How the channels of one run go together, and by which factor they go together otherwise in another run.

No channel is taken for the driver: each is foretold from each other one by the curve that a sound run shows, at the
same values of it. What physics does to a thruster (a dead band, weak reverse thrust, loss in the winding) is in both
runs' curves; what is left is a factor, near 1 where nothing was changed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations, permutations
from math import atanh, inf, isfinite, log, sqrt

import numpy as np
from numpy.typing import NDArray

from identification.estimation.tails import normal_sf, student_sf
from identification.mismatch import policy
from identification.mismatch.faults.cells import BLOCKS, held_mean, means, own
from identification.recording import Channel, Floats, Recording

CHAIN = ("command_voltage", "motor_voltage", "rotation_rate", "current", "torque", "thrust")
"""Quantities that follow one another, from the command to the force."""
SQUARES = frozenset({"current", "torque", "thrust"})
"""Those that go as the square of the others."""
MOST_CELLS = 400
"""Cells of one run: a curve of nine knots asks for no more."""
KNOTS = 9
"""Of a curve, at most: a dead band and a weak side are two of them."""
FEW_ROWS, LONG_GAP = 0.25, 20.0
"""Of a channel's rows, that they are changes: so few of them beside the thrust's, or a gap so much longer than most."""
LEAST_LEFT = 1e-4
"""Share of a variance: a law that leaves less is not the better for it."""
PASSES = 3
"""Of a fit whose residuals are clipped: starting currents and the moments after a step are no relation."""


@dataclass(frozen=True, eq=False)
class Table:
    """Means (M,) of every channel of one run over the same cells of time."""

    recording: Recording
    values: Mapping[str, Floats]

    @property
    def chain(self) -> tuple[str, ...]:
        return tuple(q for q in CHAIN if q in self.values)


@dataclass(frozen=True, slots=True)
class Relation:
    """Of one channel to what another one lets expect of it."""

    factor: float
    """Signed, measured over expected."""
    error: float
    """Standard error of the logarithm of its size."""
    explained: float
    """Share of the channel's variance, R^2."""
    beyond: float = 0.0
    """In standard errors that grow with the run-to-run variation, how far the size is from 1."""
    p_value: float = 1.0
    """That it goes with the other as in the sound run."""
    scatter: float = 1.0
    """Share of the channel's variance that is left, over that in the sound run (SCATTER_ALLOWED at least)."""

    @property
    def log(self) -> float:
        return log(abs(self.factor))

    @property
    def follows(self) -> bool:
        return self.explained >= policy.faults.STILL_FOLLOWS


@dataclass(frozen=True, eq=False)
class Curve:
    """One channel over another as one run shows it."""

    knots: Floats
    values: Floats
    known: tuple[bool, ...]
    """Of each stretch between knots, whether the run was there."""
    spread: float
    """Standard deviation of what it foretells in its own run."""
    explained: float


Curves = Mapping[tuple[str, str], Curve]


def table_of(recording: Recording) -> Table | None:
    """None where there is no thrust to count cells by."""
    clock = own(recording, "thrust")
    if clock is None:
        return None
    time = np.unique(clock.time[np.isfinite(clock.value)])
    if time.size < policy.faults.CHANNEL_CELLS:
        return None
    edges = np.linspace(time[0], time[-1] + 1e-9, MOST_CELLS + 1)
    if time.size <= 2 * MOST_CELLS:
        between = 0.5 * (time[1:] + time[:-1])
        edges = np.concatenate([[2 * time[0] - between[0]], between, [2 * time[-1] - between[-1]]])
    values = {}
    for q in dict.fromkeys(c.quantity for c in recording.channels if c.quantity):
        channel = own(recording, q)
        if channel is None or np.count_nonzero(np.isfinite(channel.value)) < 2:
            continue
        mean = held_mean(channel, edges) if _rests(channel, clock) else means(channel, edges, None)
        if np.count_nonzero(np.isfinite(mean)) >= policy.faults.CHANNEL_CELLS and np.nanstd(mean) > 0:
            values[q] = mean
    return Table(recording, values)


def _rests(channel: Channel, clock: Channel) -> bool:
    """Whether its rows are changes, each of which holds until the next, as those of a command."""
    gaps = np.diff(channel.time)
    if channel.quantity == "command_voltage" or not gaps.size:
        return True
    return channel.time.size < FEW_ROWS * clock.time.size or float(np.max(gaps)) > LONG_GAP * float(np.median(gaps))


def curves_of(table: Table) -> Curves:
    """(from, to) -> the curve, of every two channels of the chain."""
    found = {}
    for a, b in permutations(table.chain, 2):
        curve = _curve(evenly(a, table.values[a]), table.values[b])
        if curve is not None:
            found[a, b] = curve
    return found


def evenly(quantity: str, value: Floats) -> Floats:
    """On a scale over which what goes with it is nearly straight."""
    out: Floats = np.sign(value) * np.sqrt(np.abs(value)) if quantity in SQUARES else value
    return out


def _steady(x: Floats, size: float) -> Floats:
    """Weights: less where the channel moves, for those behind it lag."""
    step = np.abs(np.gradient(np.nan_to_num(x))) / max(size, 1e-300)
    out: Floats = 1.0 / (1.0 + (step / policy.faults.RELATION_STEADY) ** 2)
    return out


def _curve(x: Floats, y: Floats) -> Curve | None:
    good = np.isfinite(x) & np.isfinite(y)
    if np.count_nonzero(good) < policy.faults.CHANNEL_CELLS:
        return None
    low, high = np.quantile(x[good], [0.005, 0.995])
    if not high > low:
        return None
    many = int(np.clip(np.count_nonzero(good) // 4, 3, KNOTS))
    knots = np.linspace(low, high, many)
    H, weight = _hats(x[good], knots), _steady(x, high - low)[good]
    rough = np.diff(np.eye(many), 2, axis=0) * 0.03 * np.sqrt(np.sum(weight))
    beta, left = np.zeros(many), y[good]
    for _ in range(PASSES):
        w = np.sqrt(weight * _clipped(left))
        A = np.vstack([H * w[:, None], rough])
        beta = np.linalg.lstsq(A, np.concatenate([y[good] * w, np.zeros(rough.shape[0])]), rcond=None)[0]
        left = y[good] - H @ beta
    kept = weight * _clipped(left)
    total = _variance(y[good], kept)
    if not total > 0:
        return None
    inside = np.bincount(np.clip(np.searchsorted(knots, x[good]) - 1, 0, many - 2), minlength=many - 1)
    explained = 1.0 - _variance(left, kept) / total
    known = tuple(bool(n) for n in inside >= 2)
    return Curve(knots, beta, known, sqrt(_variance(H @ beta, weight)), explained)


def _hats(x: Floats, knots: Floats) -> Floats:
    """(n, k): the columns of a line broken at `knots`."""
    at = np.clip((x - knots[0]) / (knots[1] - knots[0]), 0, knots.size - 1)
    out: Floats = np.maximum(0.0, 1.0 - np.abs(at[:, None] - np.arange(knots.size)[None, :]))
    return out


def _clipped(left: Floats) -> Floats:
    """Huber's weights at 3 robust standard deviations."""
    size = np.abs(left - np.median(left))
    scale = 3 * 1.4826 * float(np.median(size))
    return np.ones_like(left) if not scale > 0 else np.minimum(1.0, scale / np.maximum(size, 1e-300))


def lawless(table: Table) -> float:
    """Mean logarithm of the share of a channel that the law of its kind leaves: proportion among voltages and rates,
    the square, of its own on either side, for currents and forces."""
    left = []
    for a, b in combinations(table.chain, 2):
        x, y = (evenly(q, table.values[q]) for q in (a, b))
        good = np.isfinite(x) & np.isfinite(y)
        columns = np.column_stack([np.ones(x.size), np.maximum(x, 0), np.minimum(x, 0)])[good]
        weight, rest = _steady(x, float(np.ptp(x[good])))[good], y[good]
        for _ in range(PASSES):
            w = weight * _clipped(rest)
            root = np.sqrt(w)
            beta = np.linalg.lstsq(columns * root[:, None], y[good] * root, rcond=None)[0]
            rest = y[good] - columns @ beta
        left.append(log(max(_variance(rest, w) / max(_variance(y[good], w), 1e-300), LEAST_LEFT)))
    return float(np.mean(left)) if left else 0.0


def _variance(y: Floats, weight: Floats) -> float:
    total = float(np.sum(weight))
    middle = float(np.sum(weight * y)) / total
    return float(np.sum(weight * (y - middle) ** 2)) / total


def relation(table: Table, sound: Curves, a: str, b: str) -> Relation | None:
    """Channel `b` of this run to what `a` lets expect by the sound run; None where they share no values of `a`."""
    curve, x, y = sound.get((a, b)), evenly(a, table.values[a]), table.values[b]
    if curve is None or curve.explained < policy.faults.FOLLOWS_LAW:
        return None
    slot = np.clip(np.searchsorted(curve.knots, np.nan_to_num(x)) - 1, 0, curve.knots.size - 2)
    good = np.isfinite(x) & np.isfinite(y) & (x >= curve.knots[0]) & (x <= curve.knots[-1])
    good &= np.array(curve.known)[slot] & (np.abs(x) >= policy.faults.DRIVEN_LEVEL * np.max(np.abs(curve.knots)))
    if np.count_nonzero(good) < policy.faults.CHANNEL_CELLS:
        return None
    expected = np.interp(x[good], curve.knots, curve.values)
    weight = _steady(x, float(curve.knots[-1] - curve.knots[0]))[good]
    if sqrt(_variance(expected, weight)) < policy.faults.RELATION_SPREAD * curve.spread:
        return None
    block = np.flatnonzero(good) * BLOCKS // x.size
    return _judged(_fitted(expected, y[good], weight, block), b, curve.explained)


def _fitted(expected: Floats, y: Floats, weight: Floats, block: NDArray[np.intp]) -> tuple[float, float, float]:
    """Slope, its standard error over blocks (sandwich of clusters, Liang and Zeger 1986), and R^2."""
    slope, level, w, left = 0.0, 0.0, weight, y
    for i in range(PASSES):
        w = weight * _clipped(left) if i else weight
        middle = float(np.sum(w * expected) / np.sum(w))
        centred = expected - middle
        slope = float(np.sum(w * centred * y) / np.sum(w * centred**2))
        level = float(np.sum(w * y) / np.sum(w)) - slope * middle
        left = y - level - slope * expected
    score = np.bincount(block, weights=w * (expected - np.sum(w * expected) / np.sum(w)) * left)
    bread = float(np.sum(w * (expected - np.sum(w * expected) / np.sum(w)) ** 2))
    total = _variance(y, w)
    return slope, sqrt(float(score @ score)) / bread, 1.0 - _variance(left, w) / total if total > 0 else 0.0


def _judged(fit: tuple[float, float, float], b: str, sound: float) -> Relation:
    slope, error, explained = fit
    if slope == 0.0:
        return Relation(1e-12, inf, 0.0, inf, 0.0, inf)
    relative, scatter = error / abs(slope), (1.0 - explained) / max(1.0 - sound, float(policy.faults.SCATTER_ALLOWED))
    if explained < policy.faults.STILL_FOLLOWS:
        least = 1.0 - policy.faults.SCATTER_RUN_TO_RUN * max(1.0 - sound, float(policy.faults.SCATTER_ALLOWED))
        return Relation(slope, relative, explained, inf, strange_p(explained, least), scatter)
    if slope < 0:
        return Relation(slope, relative, explained, inf, float(normal_sf(1 / max(relative, 1e-9))), scatter)
    z = log(slope) / sqrt(relative**2 + run_to_run(b) ** 2)
    return Relation(slope, relative, explained, abs(z), varied_p(z), scatter)


def run_to_run(quantity: str) -> float:
    """Standard deviation of the logarithm by which a channel differs between sound runs."""
    return float(policy.faults.RUN_TO_RUN) * (2.0 if quantity in SQUARES else 1.0)


def varied_p(z: float) -> float:
    """Two-sided, of a factor that is `z` standard deviations from 1 where these are known from a few runs only."""
    return 2 * float(student_sf(abs(z), int(policy.faults.RUN_TO_RUN_DEGREES))) if isfinite(z) else 0.0


def strange_p(explained: float, least: float) -> float:
    """Of a channel of which another explains `least` (R^2), to be seen to follow it so little in BLOCKS stretches.

    Fisher's transformation of the correlation (Biometrika 10, 1915, 507): variance 1 / (n - 3).
    """
    was, seen = (atanh(sqrt(min(max(r, 0.0), 0.999))) for r in (least, explained))
    return float(normal_sf((was - seen) * sqrt(BLOCKS - 3)))
