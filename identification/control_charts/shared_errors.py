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
    REACH of what its calibration states: what is more can't be the calibration's.
    """
    out = np.array(value, dtype=np.float64)
    names = [int(name) for name in np.unique(group)]
    where = {name: (group == name) for name in names}
    counted = {name: where[name] & good for name in names}
    told = [name for name in names if np.count_nonzero(counted[name]) >= FEWEST] or names[:1]
    middle = {name: float(np.median(value[counted[name] if counted[name].any() else where[name]])) for name in told}
    own = {name: float(np.median(stated[where[name]])) for name in told}
    error = {
        name: MEDIAN_ERROR * float(np.median(spread[where[name]])) / max(int(np.count_nonzero(counted[name])), 1) ** 0.5
        for name in told
    }
    weight = {name: 1.0 / max(own[name] ** 2 + error[name] ** 2, 1e-300) for name in told}
    centre = sum(weight[name] * middle[name] for name in told) / sum(weight.values())
    found = []
    for name in told:
        difference = middle[name] - centre
        share = own[name] ** 2 * weight[name]
        removed = float(np.clip(share * difference, -REACH * own[name], REACH * own[name]))
        out[where[name]] -= removed
        found.append(SharedError(name, int(np.count_nonzero(counted[name])), difference, own[name], removed))
    return out, centre, tuple(found)
