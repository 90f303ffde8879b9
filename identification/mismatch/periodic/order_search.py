"""Which order of the rotor stands out of the noise: by power, stretch for stretch, and by waves that keep their phase.

The angle turned is known well within a stretch of steady turning and less well across steps, and less and less the
longer a measured rate with noise is summed up. A wave of one phase stands out far more than the same power with a
phase for each stretch, so both are looked for, over several times for which the phase may last.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import next_fast_len

from identification.estimation.tails import chi2_sf, gamma_median, gamma_sf
from identification.mismatch import policy
from identification.mismatch.periodic.spectrum import CELLS, OVERSAMPLING, family_wise, transform
from identification.mismatch.periodic.steady_segments import SteadySegment
from identification.recording import Floats

LASTING = (np.inf, 60.0)
"""s for which a phase may last."""
SPEEDS = 12
"""Groups of speed: no single one of them may carry a line that is locked to the rotor."""
ORDERS = 12
"""Whole ratios that are a family of their own: blades, bolts and bearings come in such numbers."""
AROUND = 5
"""Ratios round the best one over which it may have its best without one group of speed."""
LARGEST_SHAPE = 1e6
"""Of the gamma variate that a sum of powers is: more of it has no spread that could be told."""
ALIAS_REACH = 4.0
"""Widths of a peak of the longest stretch round an alias: the speeds at which it is loudest are several."""


@dataclass(frozen=True, slots=True)
class OrderCandidate:
    """A peak of the spectrum over turns that may be an order of the rotor."""

    ratio: float
    """Periods per turn."""
    reach: float
    """Of the ratio: half the width of its peak."""
    p_value: float
    """Family-wise."""


Piece = list[tuple[SteadySegment, int]]
"""Stretches over which a wave may keep its phase, each with its group of speed."""


@dataclass(frozen=True, eq=False)
class _Grid:
    """Ratios that are looked at, and the transform that gives them."""

    cell: float
    """Turns."""
    length: int
    ratios: Floats
    keep: slice
    longest: float
    """Turns of the longest piece."""

    def power(self, turns: Floats, value: Floats) -> Floats:
        """|sum value exp(-2 pi i z turns)|^2 at each ratio z."""
        out: Floats = np.abs(transform(turns, value, self.cell, self.length)[self.keep]) ** 2
        return out


def candidates(parts: Sequence[SteadySegment], top: float) -> list[OrderCandidate]:
    """The best by each way to look, its p-value that of all ways; `top`: highest speed, turns per s."""
    found = [_of_powers(parts, top), *(_of_waves(parts, top, seconds) for seconds in LASTING)]
    return [replace(each, p_value=min(len(found) * each.p_value, 1.0)) for each in found]


def aliases(parts: Sequence[SteadySegment], found: OrderCandidate, rate: float, top: float) -> list[OrderCandidate]:
    """Ratios that samples at `rate` (1/s) show as this one at the speed `top`: there their waves are the same.

    A force of the rotor is nearly all at the highest speeds, so that a wrong one of these may look clear; at the other
    speeds they part.
    """
    low, high = policy.periodic.LOWEST_ORDER / top, policy.periodic.HIGHEST_ORDER / top
    reach = ALIAS_REACH / max(float(np.ptp(p.turns)) for p in parts)
    whole = np.arange(int(2 * policy.periodic.HIGHEST_ORDER / rate) + 2) * rate / top
    ratios = np.unique(np.abs(np.concatenate([whole + found.ratio, whole - found.ratio])))
    apart = ratios[(ratios > low) & (ratios < high) & (np.abs(ratios - found.ratio) > reach)]
    return [replace(found, ratio=z, reach=reach) for z in apart.tolist()]


def _grid(longest: float, top: float) -> _Grid:
    highest = policy.periodic.HIGHEST_ORDER / top
    cell = 1.0 / (CELLS * highest)
    length = next_fast_len(OVERSAMPLING * (int(longest / cell) + 2), real=True)
    step = 1.0 / (length * cell)
    keep = slice(int(np.ceil(policy.periodic.LOWEST_ORDER / top / step)), int(highest / step))
    return _Grid(cell, length, np.arange(keep.start, keep.stop, dtype=np.float64) * step, keep, longest)


def _groups(parts: Sequence[SteadySegment], top: float) -> list[int]:
    """Group of speed of each stretch."""
    return [min(int(SPEEDS * p.speed / top), SPEEDS) for p in parts]


def _of_powers(parts: Sequence[SteadySegment], top: float) -> OrderCandidate:
    """Powers summed over the stretches; noise as each has it at its own speeds."""
    grid = _grid(max(float(p.turns[-1] - p.turns[0]) for p in parts), top)
    by_group = np.zeros((SPEEDS + 1, grid.ratios.size))
    for p, g in zip(parts, _groups(parts, top), strict=True):
        window = np.hanning(p.time.size + 2)[1:-1]
        power = p.colour.out_of(grid.power(p.turns, p.value * window), grid.ratios, p.speeds)
        by_group[g] += p.information / p.time.size * power
    kept = by_group[by_group.any(axis=1)]
    if kept.shape[0] < 2:
        return OrderCandidate(1.0, 1.0, 1.0)
    total = kept.sum(axis=0)
    strong, shape = standing(total)
    at, p_value = _highest(strong, shape, grid, 0.0)
    without, rest_shape = standing(total - kept[int(np.argmax(kept[:, at]))])
    around = slice(max(at - AROUND // 2, 0), at + AROUND // 2 + 1)
    p_rest = float(gamma_sf(np.max(without[around]), rest_shape)) * AROUND
    return OrderCandidate(float(grid.ratios[at]), 0.5 / grid.longest, max(p_value, p_rest))


def _of_waves(parts: Sequence[SteadySegment], top: float, seconds: float) -> OrderCandidate:
    """Whitened waves summed with their phase over pieces of so many seconds, their powers over the pieces."""
    pieces = pieces_of(parts, top, seconds)
    grid = _grid(longest_of(pieces), top)
    total = np.zeros(grid.ratios.size)
    for piece in pieces:
        turns = np.concatenate([p.turns for p, _ in piece])
        white = np.concatenate([np.abs(p.weight) * p.white for p, _ in piece])
        total += grid.power(turns, white) / sum(p.information for p, _ in piece)
    strong, shape = standing(total)
    at, p_value = _highest(strong, shape, grid, 1.0 / grid.longest)
    ratio = float(grid.ratios[at])
    return OrderCandidate(ratio, 1.0 / grid.longest, max(p_value, even(pieces, ratio)))


def pieces_of(parts: Sequence[SteadySegment], top: float, seconds: float) -> list[Piece]:
    """The stretches of every so many seconds of a run, each with its group of speed."""
    found: dict[tuple[int, int], Piece] = defaultdict(list)
    for p, g in zip(parts, _groups(parts, top), strict=True):
        found[p.run, int(p.time[0] // seconds)].append((p, g))
    return list(found.values())


def longest_of(pieces: Sequence[Piece]) -> float:
    """Turns of the longest piece."""
    return max(float(piece[-1][0].turns[-1] - piece[0][0].turns[0]) for piece in pieces)


def even(pieces: Sequence[Piece], ratio: float) -> float:
    """p-value of the waves without the group of speed that gives most of them; 1 when they differ between groups.

    A plan that comes again turns the rotor as often, and what the model lacks comes again with it: but not as one wave,
    of one phase at every speed, and of the size that its law gives it there, going up and going down.
    """
    sums = np.zeros((len(pieces), 3 * (SPEEDS + 1)), dtype=np.complex128)
    n = np.zeros(sums.shape)
    for i, piece in enumerate(pieces):
        for p, g in piece:
            sums[i, 3 * g + p.trend(policy.periodic.STEADY_SPEED)] += p.wave(ratio)
            n[i, 3 * g + p.trend(policy.periodic.STEADY_SPEED)] += p.information
    used = n > 0
    each = float(np.sum(np.abs(sums[used]) ** 2 / n[used]))
    lost = each - float(np.sum(np.abs(sums.sum(axis=1)) ** 2 / n.sum(axis=1)))
    freedom = np.count_nonzero(used) - len(pieces)  # none: one speed in each piece, and nothing to compare
    if freedom and chi2_sf(2 * lost, 2.0 * freedom) < policy.periodic.UNEVEN_WAVE_P:
        return 1.0
    by_speed, size = (x.reshape(len(pieces), -1, 3).sum(axis=2) for x in (sums, n))
    there = size.any(axis=0)
    if np.count_nonzero(there) < 2:
        return 1.0
    rest, left = by_speed.sum(axis=1)[:, None] - by_speed, size.sum(axis=1)[:, None] - size
    powers = np.where(left > 0, np.abs(rest) ** 2 / np.maximum(left, 1e-300), 0.0).sum(axis=0)
    loudest = int(np.argmin(np.where(there, powers, np.inf)))
    return AROUND * float(gamma_sf(powers[loudest], float(np.count_nonzero(left[:, loudest]))))


def _highest(strong: Floats, shape: float, grid: _Grid, near: float) -> tuple[int, float]:
    """Place of the most significant sum of powers, and its family-wise p-value.

    Whole numbers, to `near`, are a family of their own: blades, and the bolts and bearings of a shaft, come so many to
    a turn.
    """
    z = grid.ratios
    at = int(np.argmax(strong))
    p = family_wise(float(gamma_sf(strong[at], shape)), float(strong[at]), float(z[-1] - z[0]) * grid.longest)
    orders = [k for k in range(1, ORDERS + 1) if z[0] <= k <= z[-1]]
    if orders:
        close = [_nearest(z, k, near) for k in orders]
        order = max((i for some in close for i in some), key=lambda i: strong[i])
        tried = len(orders) * (1.0 + OVERSAMPLING * 2.0 * near * grid.longest)
        p, at = min((p, at), (tried * float(gamma_sf(strong[order], shape)), order))
    return at, 2.0 * p


def _nearest(z: Floats, order: int, near: float) -> range:
    """Indices of the ratios within `near` of a whole order; the nearest one at least."""
    middle = int(np.argmin(np.abs(z - order)))
    around = int(near / (z[1] - z[0])) if z.size > 1 else 0
    return range(max(middle - around, 0), min(middle + around + 1, z.size))


def standing(total: Floats) -> tuple[Floats, float]:
    """The sum of powers as a gamma variate of scale 1 and the shape returned: mean and spread as the bulk has them."""
    block = max(total.size // 16, 8)
    count = max(total.size // block, 1)
    size = total.size // count
    blocks = total[: count * size].reshape(count, size)
    middle = (np.arange(count) + 0.5) * size
    low, centre, high = np.quantile(blocks, (0.1587, 0.5, 0.8413), axis=1)
    spread = np.maximum(np.maximum(0.5 * (high - low), centre / LARGEST_SHAPE**0.5), 1e-300)
    shape = float(np.clip(np.median((centre / spread) ** 2), 1.0, LARGEST_SHAPE))
    level_now = np.interp(np.arange(total.size), middle, np.maximum(centre, 1e-300))
    expected = gamma_median(shape)
    out: Floats = total / level_now * expected
    return out, shape
