"""Where a driver stands still: pieces of a run in each of which its intervals have one value.

Intervals follow the samples of all channels, and a command that ticks has some of them in each tick. What follows it
by an equation that is solved for any time needs one step for a piece, not one for each of its intervals.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

SAME = 1e-8
"""Of the largest value: means over intervals of what stands still differ by the rounding of their edges, behind a dead
band, which is a difference of integrals, by some 1e-9."""
WORTH = 0.5
"""Of the intervals: of more pieces nothing is saved."""


class Held(NamedTuple):
    """T pieces of M intervals."""

    first: NDArray[np.intp]
    """(T,) interval of each that is its first."""
    last: NDArray[np.intp]
    """(T,)."""
    time: Floats
    """(T,) s that each lasts."""
    which: NDArray[np.intp]
    """(M,) piece that each interval is in."""
    since: Floats
    """(M,) s from the beginning of its piece to the end of each interval."""

    def holds(self, value: Floats) -> bool:
        """Whether `value` (M,) stands still in each piece, too."""
        moved = np.abs(value - value[self.first][self.which])
        return float(np.max(moved)) <= SAME * float(np.max(np.abs(value)))

    def beside_before(self, total: Floats) -> Floats:
        """(M,) of each interval, of a `total` (M,) from the beginning of its piece to its end."""
        out = total.copy()
        out[1:] -= total[:-1]
        out[self.first] = total[self.first]
        return out


def held_of(value: Floats, dt: Floats) -> Held | None:
    """The pieces in which `value` (M,) stands still, of intervals of length `dt` in s; None where they are too many.

    >>> held_of(np.array([1.0, 1.0, 1.0, 4.0]), np.array([0.5, 0.5, 1.0, 2.0])).since.tolist()
    [0.5, 1.0, 2.0, 2.0]
    """
    moves = np.abs(np.diff(value)) > SAME * np.max(np.abs(value), initial=0.0)
    first = np.concatenate([[0], np.flatnonzero(moves) + 1])
    if not value.size or first.size > WORTH * value.size:
        return None
    last = np.append(first[1:], value.size) - 1
    which = np.repeat(np.arange(first.size), last - first + 1)
    end = np.cumsum(dt)
    begin = end[first] - dt[first]
    return Held(first, last, end[last] - begin, which, end - begin[which])
