"""A driver that was measured, not told: how noisy it is, where it jumps, and when it is known between its samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

JUMP = 0.02
"""Share of the largest driver: a smaller change between two samples is no jump."""
ALONE = 3.0
"""Times the changes on both sides: a jump is quicker than the samples, what merely moves goes on in the next ones."""
NOISES = 6.0
"""Standard deviations of a sample: what changes by less may be noise."""
TOLD = 0.003
"""Of the largest driver: where a straight line between samples may be off by more, and by more than..."""
TOLD_NOISES = 2.0
"""...so many standard deviations of a sample, the driver is not known."""
ENOUGH = 0.7
"""Of the thrust samples: where fewer would be left, the driver moves too fast for its samples everywhere."""
INSTANT = 1e-6
"""Of the time between two samples: how long a jump is made to take."""


def noise_of(value: Floats) -> float:
    """Standard deviation of a sample, robust: from third differences, in which ramps and slow sines vanish."""
    if value.size < 5:
        return 0.0
    return float(np.median(np.abs(np.diff(value, 3))) / (0.6745 * np.sqrt(20.0)))


def jumped(value: Floats, noise: float) -> NDArray[np.bool_]:
    """(n-1,) where the driver went to another level between two samples."""
    step = np.abs(np.diff(value))
    beside = np.maximum(np.append(step[1:], 0.0), np.append(0.0, step[:-1]))
    least = max(JUMP * float(np.max(np.abs(value), initial=0.0)), NOISES * noise)
    out: NDArray[np.bool_] = step > least + ALONE * beside
    return out


def with_jumps(time: Floats, value: Floats, jumps: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """The samples, and on either side of the middle of each gap that holds a jump the level there."""
    at = np.flatnonzero(jumps)
    middle, half = 0.5 * (time[at] + time[at + 1]), 0.5 * INSTANT * (time[at + 1] - time[at])
    index = np.repeat(at + 1, 2)
    when = np.column_stack([middle - half, middle + half]).ravel()
    return np.insert(time, index, when), np.insert(value, index, np.column_stack([value[at], value[at + 1]]).ravel())


def known(time: Floats, value: Floats, jumps: NDArray[np.bool_], noise: float, at: Floats) -> NDArray[np.bool_]:
    """(N,) whether the straight lines between the samples tell the driver at the times `at`."""
    gap = np.clip(np.searchsorted(time, at, side="right") - 1, 0, time.size - 2)
    share = np.clip((at - time[gap]) / (time[gap + 1] - time[gap]), 0.0, 1.0)
    step = np.diff(value)
    bend = np.where(jumps[1:] | jumps[:-1], 0.0, np.abs(np.diff(step)))
    bent = np.maximum(np.append(bend, 0.0), np.append(0.0, bend))
    smooth = 0.5 * share * (1 - share) * bent[gap]
    across = np.minimum(share, 1 - share) * np.abs(step[gap])
    off = np.where(jumps[gap], across, smooth)
    out: NDArray[np.bool_] = off <= max(TOLD * float(np.max(np.abs(value))), TOLD_NOISES * noise)
    return out
