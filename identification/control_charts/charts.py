"""Shewhart's chart and that of the exponentially weighted mean (EWMA) of one figure over the units of a production."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identification.control_charts.shared_errors import SharedError, without_shared_errors
from identification.control_charts.spread import unit_spread
from identification.estimation.tails import normal_quantile
from identification.recording import Floats

WEIGHT = 0.2
"""Of the newest unit in the EWMA: 0.05 to 0.25 are usual, 0.2 sees a shift of one standard deviation soonest
(Lucas and Saccucci, Technometrics 32, 1990, table 3)."""
ROUNDS = 8
"""Of centre and limits, each without the units that the one before found outside (phase I), and without one stretch
more: a drift moves the median of its calibration, and what is sound beside it then looks off to the other side."""
FALSE_ALARMS = 0.05
"""Share of fleets without any odd unit in which all charts together may show one."""

Side = Literal["both", "high"]
Truths = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Stretch:
    """Units first .. last, by their places, whose mean is off: `since` when, and for how long, as far as it shows."""

    first: int
    last: int
    size: float
    """Median of the deviation of its units, in standard deviations of a unit."""


@dataclass(frozen=True, eq=False)
class Chart:
    """Of one figure over n units in order."""

    value: Floats
    """(n,) less the shared errors of calibrations."""
    centre: float
    sigma: Floats
    """(n,) of a unit about the centre: from unit to unit, and its own measurement."""
    spread: float
    """Of it the part from unit to unit; 0: the measurements explain all."""
    limit: float
    """Both limits, in sigma."""
    side: Side
    mean: Floats
    """(n,) EWMA of the deviations, in sigma."""
    mean_limit: Floats
    """(n,) its limit."""
    outside: Truths
    """(n,) truths: beyond Shewhart's limits."""
    stretches: tuple[Stretch, ...]
    shared: tuple[SharedError, ...]

    @property
    def deviation(self) -> Floats:
        """(n,) in sigma."""
        out: Floats = (self.value - self.centre) / self.sigma
        return out


def limit_for(units: int, charts: int, share: float = FALSE_ALARMS) -> float:
    """Limits in sigma that all charts of a fleet without an odd unit exceed in at most `share` of cases (Bonferroni).

    >>> round(limit_for(2000, 6), 2), round(limit_for(20, 6), 2)
    (4.6, 3.53)
    """
    return float(normal_quantile(1.0 - share / (2 * units * charts)))


def chart(value: Floats, std: Floats, group: Floats, stated: Floats, limit: float, side: Side = "both") -> Chart:
    """The chart of a figure.

    `value` (n,) in order of production, finite; `std` (n,) of each measurement's own scatter; `group` (n,) whole
    numbers from 0, which calibration; `stated` (n,) standard deviation of the error that all of a calibration share;
    all in the unit of `value`. `limit`: of both charts, in standard deviations. Raises ValueError for fewer than three
    units.
    """
    if value.size < 3:
        raise ValueError(f"a chart needs three units at least, and there are {value.size}")
    spread = unit_spread(value, std, group)
    sigma = np.sqrt((spread if np.isfinite(spread) else float(np.std(value))) ** 2 + std**2)
    sigma = np.maximum(sigma, 1e-12 * max(float(np.abs(value).max()), 1e-300))
    good = np.ones(value.size, dtype=bool)
    found = _drawn(value, sigma, spread, group, stated, limit, side, good)
    for count in range(1, ROUNDS + 1):
        now = ~found.outside
        for stretch in sorted(found.stretches, key=_strength, reverse=True)[:count]:
            now[stretch.first : stretch.last + 1] = False
        whole = len(found.stretches) <= count and np.array_equal(now, good)
        if whole or np.count_nonzero(now) < value.size / 2:
            break
        good = now
        found = _drawn(value, sigma, spread, group, stated, limit, side, good)
    return found


def _strength(stretch: Stretch) -> float:
    """Of its mean, in standard deviations of that."""
    return float(abs(stretch.size) * np.sqrt(stretch.last - stretch.first + 1))


def _drawn(
    value: Floats,
    sigma: Floats,
    spread: float,
    group: Floats,
    stated: Floats,
    limit: float,
    side: Side,
    good: Truths,
) -> Chart:
    less, centre, shared = without_shared_errors(value, group, stated, sigma, good)
    deviation = (less - centre) / sigma
    outside = deviation > limit if side == "high" else np.abs(deviation) > limit
    alone = outside & ~np.concatenate((outside[1:], [False])) & ~np.concatenate(([False], outside[:-1]))
    held = np.where(alone, 0.0, np.clip(deviation, -limit, limit))  # one unit far off is no drift of its neighbours
    mean, mean_limit = ewma(held), limit * ewma_std(value.size)
    stretches = _stretches(deviation, held, mean, mean_limit, side)
    return Chart(less, centre, sigma, spread, limit, side, mean, mean_limit, outside, stretches, shared)


def ewma(deviation: Floats, weight: float = WEIGHT) -> Floats:
    """(n,) w_i = weight z_i + (1 - weight) w_(i-1), from 0 (Roberts, Technometrics 1, 1959).

    >>> ewma(np.array([1.0, 1.0, 0.0]), 0.5).tolist()
    [0.5, 0.75, 0.375]
    """
    out = np.empty(deviation.size)
    level = 0.0
    for i, z in enumerate(deviation.tolist()):
        level += weight * (z - level)
        out[i] = level
    return out


def ewma_std(units: int, weight: float = WEIGHT) -> Floats:
    """(n,) standard deviation of the EWMA of independent deviations of 1, from its beginning on."""
    i = np.arange(1, units + 1)
    out: Floats = np.sqrt(weight / (2.0 - weight) * (1.0 - (1.0 - weight) ** (2 * i)))
    return out


def _stretches(deviation: Floats, held: Floats, mean: Floats, limit: Floats, side: Side) -> tuple[Stretch, ...]:
    """Where the EWMA is beyond its limits: from where it last was at the centre (Nishina, Qual. Reliab. Eng. Int. 8,
    1992) to where the one that begins at the other end last was."""
    back = ewma(held[::-1])[::-1]
    found: list[Stretch] = []
    for sign in (1.0,) if side == "high" else (1.0, -1.0):
        ours: list[tuple[int, int]] = []
        left = runs_of(sign * back > limit[::-1])
        for begin, end in runs_of(sign * mean > limit):
            first = begin
            while first > 0 and sign * mean[first - 1] > 0:
                first -= 1
            last = max((stop for start, stop in left if start <= end and stop >= first), default=end)
            while last + 1 < back.size and sign * back[last + 1] > 0:
                last += 1
            if ours and first <= ours[-1][1] + 1:
                earlier = ours.pop()
                first, last = earlier[0], max(last, earlier[1])
            ours.append((first, last))
        found += [Stretch(a, b, float(np.median(deviation[a : b + 1]))) for a, b in ours]
    return tuple(sorted(found, key=lambda stretch: stretch.first))


def runs_of(true: Truths) -> list[tuple[int, int]]:
    """First and last place of each run of truths.

    >>> runs_of(np.array([True, True, False, True]))
    [(0, 1), (3, 3)]
    """
    edge = np.diff(np.concatenate(([0], true.astype(np.int8), [0])))
    starts, stops = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1
    return list(zip(starts.tolist(), stops.tolist(), strict=True))
