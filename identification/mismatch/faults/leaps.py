"""A measured rate that leaps where nothing follows: a tachometer that wakes, or catches a spark.

Only where the rate stands in the place of a command. From rest to rest it goes beyond all that the run has elsewhere,
for a moment, and over that moment and the rest behind it the thrust has nearly nothing of what the law of all other
samples makes of it: water that follows late gives as much, later.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identification.estimation.tails import student_sf
from identification.mismatch import policy
from identification.mismatch.faults.cells import Cells, fitted, shapes
from identification.mismatch.value import Value
from identification.recording import Floats

Leap = tuple[str, str, float, dict[str, Value]]
RATE = "rotation_rate"


def leaps(cells: Cells) -> Iterator[Leap]:
    """(quantity, statement, p-value, parameters) of each."""
    thrust = cells.values.get("thrust")
    if cells.driver_quantity != RATE or thrust is None:
        return
    moving = np.abs(cells.driver) > policy.faults.LEAP_REST
    for low, high in _stretches(moving):
        elsewhere = moving.copy()
        elsewhere[low:high] = False
        short = cells.time[high - 1] - cells.time[low] < policy.faults.LEAP_SHARE * np.ptp(cells.time)
        size = np.abs(cells.driver)
        if not (short and elsewhere.any() and size[low:high].max() > policy.faults.LEAP_BEYOND * size[elsewhere].max()):
            continue
        share, p = _followed(cells, thrust, slice(low, _next_motion(moving, high)))
        if share < policy.faults.LEAP_FOLLOWED:
            yield RATE, *_told(cells, low, high, share, p)


def _stretches(moving: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one past the last cell of each motion that begins and ends at rest."""
    edges = np.flatnonzero(np.diff(moving.astype(int)))
    if moving[0]:
        edges = edges[1:]
    return [(int(a) + 1, int(b) + 1) for a, b in zip(edges[::2], edges[1::2], strict=False)]


def _next_motion(moving: NDArray[np.bool_], after: int) -> int:
    later = np.flatnonzero(moving[after:])
    return after + int(later[0]) if later.size else moving.size


def _followed(cells: Cells, thrust: Floats, there: slice) -> tuple[float, float]:
    """Share of the thrust that the rate promises `there` which came, and the p-value that all of it did."""
    law = shapes(cells.driver)["sides" if cells.both_ways else "quadratic"]
    outside = thrust.copy()
    outside[there] = np.nan
    beta, left = fitted(law, outside)
    inside = np.isfinite(thrust[there])
    came = float(np.sum((thrust[there] - beta[0])[inside]))
    promised = float(np.sum((law[there] @ beta - beta[0])[inside]))
    known = np.isfinite(left)
    error = policy.faults.LEAP_COLOURED * float(np.std(left[known])) * np.sqrt(np.count_nonzero(inside))
    if promised == 0.0 or error == 0.0:
        return 1.0, 1.0
    missing = (promised - came) * np.sign(promised)
    return came / promised, float(student_sf(missing / error, np.count_nonzero(known) - law.shape[1]))


def _told(cells: Cells, low: int, high: int, share: float, p: float) -> tuple[str, float, dict[str, Value]]:
    before, behind = max(low - 1, 0), min(high, cells.time.size - 1)
    start, end = float(cells.time[before]), float(cells.time[behind])
    peak = cells.size * float(cells.driver[low:high][np.argmax(np.abs(cells.driver[low:high]))])
    says = (
        f"{RATE} reads up to {peak:.4g} rev/s from {start:.4g} s to {end:.4g} s, more than anywhere else, and the cell "
        f"shows {100 * max(share, 0.0):.2g} % of the thrust of such a rate: the reading is false, it did not turn so."
    )
    return says, p, {"start": Value(start, 0.0, "s"), "end": Value(end, 0.0, "s"), "peak": Value(peak, 0.0, "rev/s")}
