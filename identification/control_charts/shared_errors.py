"""The error that all units measured under one calibration share, taken out: as far as the calibration admits it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

REACH = 2.0
"""Standard deviations of its calibration by which a group may be moved: 95 % of what its certificate states."""
MEDIAN_ERROR = 1.2533141373155003
"""Standard error of a median of normal values over that of their mean, sqrt(pi / 2)."""
FEWEST = 5
"""Units of a group whose median says where it lies."""


@dataclass(frozen=True, slots=True)
class SharedError:
    """Of the units of one calibration, all in the unit of the values."""

    group: int
    units: int
    """That were counted."""
    difference: float
    """Of its median from that of the whole fleet."""
    stated: float
    """Standard deviation that its calibration states."""
    removed: float
    """What was taken out of each of its units; the rest stays in the chart."""

    @property
    def beyond(self) -> bool:
        """Whether its units lie further off than the calibration explains."""
        return abs(self.difference) > REACH * self.stated > 0 and self.removed != self.difference


def without_shared_errors(
    value: Floats, group: Floats, stated: Floats, spread: Floats, good: NDArray[np.bool_]
) -> tuple[Floats, float, tuple[SharedError, ...]]:
    """(values less the shared error of their group, the centre, what was taken out of each group).

    `value` (n,), `group` (n,) whole numbers from 0, `stated` (n,) standard deviation of the error that a group shares,
    `spread` (n,) of a unit about its group, `good` (n,) of truths: units that count. The centre is the mean of the
    groups' medians, each weighed by what is known of it (its stated error and the error of its median). A group's
    shared error is the best linear prediction of it (Searle, Casella and McCulloch, Variance Components, 7.4), within
    REACH of what its calibration states: what is more can't be the calibration's. A group whose units are nearly all
    out has no say in the centre; its difference from it is told.
    """
    out = np.array(value, dtype=np.float64)
    groups = [_group(int(name), value, group, stated, spread, good) for name in np.unique(group)]
    known = [each for each in groups if each.counted] or groups[:1]
    centre = sum(each.weight * each.middle for each in known) / sum(each.weight for each in known)
    found = []
    for each in groups:
        if each.units < FEWEST and each not in known:
            continue
        difference = each.middle - centre
        share = each.stated**2 * each.weight
        removed = float(np.clip(share * difference, -REACH * each.stated, REACH * each.stated))
        out[group == each.name] -= removed
        found.append(SharedError(each.name, each.units, difference, each.stated, removed))
    return out, centre, tuple(found)


@dataclass(frozen=True, slots=True)
class _Group:
    name: int
    units: int
    counted: bool
    """Enough of its units count to have a say in where the centre is."""
    middle: float
    stated: float
    weight: float
    """One over the variance of its median about the centre."""


def _group(name: int, value: Floats, group: Floats, stated: Floats, spread: Floats, good: NDArray[np.bool_]) -> _Group:
    where = group == name
    used = where & good if np.count_nonzero(where & good) >= FEWEST else where
    units, own = int(np.count_nonzero(used)), float(np.median(stated[where]))
    error = MEDIAN_ERROR * float(np.median(spread[where])) / units**0.5
    weight = 1.0 / max(own**2 + error**2, 1e-300)
    counted = units >= FEWEST and bool(np.all(good[used]))
    return _Group(name, units, counted, float(np.median(value[used])), own, weight)
