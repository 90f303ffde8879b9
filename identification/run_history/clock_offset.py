"""Offset of two clocks from what both recorded: one signal measured twice, or a command and the thrust that follows it.

For each offset the response is regressed on the shifted driver over the stretch that both cover; the offset is where
most of its variance is explained. Its standard error is a jackknife over contiguous blocks (Efron 1982), which allows
for noise that is correlated within a block. Signals that fit alike at two offsets determine none, and that is said.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

Relation = Literal["same", "thrust"]
"""`same`: response = a + b driver, b > 0; `thrust`: response = tare + C V|V| with a C for each direction."""
MOST_ROWS: Final = 2000
"""Of the response in the coarse search; neighbours are averaged."""
MOST_OFFSETS: Final = 4000
FINER: Final = 40
"""Offsets of the fine search within one step of the coarse one, on either side."""
LEAST_OVERLAP: Final = 0.5
"""Of the shorter recording: what both must cover."""
LEAST_SHARE: Final = 0.5
"""Of the response's variance, explained at the best offset."""
ALIKE: Final = 2.0
"""Two offsets fit alike when what is left at one is less than this times what is left at the other."""
BLOCKS: Final = 10
LEAST_ROWS: Final = 50


@dataclass(frozen=True, eq=False)
class Signal:
    """A channel on its own clock: `time` (n,) s, rising; `value` (n,), finite. `held`: each value until the next."""

    time: Floats
    value: Floats
    held: bool = False

    def at(self, times: Floats) -> Floats:
        """Values at times within its span."""
        if not self.held:
            return np.interp(times, self.time, self.value)
        return self.value[np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, self.time.size - 1)]


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """Seconds to add to the driver's times so that they are the response's."""

    offset: float
    std: float
    share: float
    """Of the response's variance over the common stretch."""
    overlap: float
    """s."""


@dataclass(frozen=True, slots=True)
class Undetermined:
    """Why no offset can be told, as the end of a sentence."""

    reason: str


def clock_offset(driver: Signal, response: Signal, relation: Relation) -> ClockOffset | Undetermined:
    """The offset that explains the response best, or why there is none.

    >>> t = np.arange(0.0, 60.0, 0.1)
    >>> course = np.cumsum(np.random.default_rng(2).normal(size=t.size))
    >>> found = clock_offset(Signal(t, course), Signal(t[100:] + 3.0, 2 * course[100:]), "same")
    >>> abs(found.offset - 3.0) < 0.01, found.share > 0.99
    (True, True)
    """
    if min(driver.time.size, response.time.size) < 2 or response.time.size < LEAST_ROWS:
        return Undetermined(f"{response.time.size} samples are too few; {LEAST_ROWS} are needed")
    if not np.ptp(driver.value) or not np.ptp(response.value):
        return Undetermined("one of them never changes")
    driver = _changed_between(driver)
    offsets = _offsets(driver, response)
    coarse = _thinned(response)
    left = np.array([_left(driver, coarse, offset, relation) for offset in offsets.tolist()])
    best = int(np.argmin(left))
    if left[best] > 1 - LEAST_SHARE:
        return Undetermined(
            f"at no offset does one explain the other (at best {100 * max(1 - left[best], 0.0):.0f} % of its variance)"
        )
    rival = _rival(left, best)
    if rival is not None:
        return Undetermined(f"they fit alike at {offsets[best]:+.4g} s and at {offsets[rival]:+.4g} s")
    return _refined(driver, response, relation, float(offsets[best]), float(offsets[1] - offsets[0]))


def _changed_between(driver: Signal) -> Signal:
    """A held driver that is logged, not written at its changes: each change came between two rows, on the average half
    a row before the one that shows it."""
    if not _logged(driver):
        return driver
    return Signal(driver.time - 0.5 * float(np.median(np.diff(driver.time))), driver.value, held=True)


def _logged(driver: Signal) -> bool:
    return driver.held and float(np.mean(np.diff(driver.value) != 0)) < 0.5


def _offsets(driver: Signal, response: Signal) -> Floats:
    """Those at which both cover enough in common."""
    need = LEAST_OVERLAP * min(float(np.ptp(driver.time)), float(np.ptp(response.time)))
    low = response.time[0] + need - driver.time[-1]
    high = response.time[-1] - need - driver.time[0]
    step = max(float(np.median(np.diff(response.time))), (high - low) / MOST_OFFSETS)
    return np.arange(low, high + 0.5 * step, step)


def _thinned(response: Signal) -> Signal:
    per = -(-response.time.size // MOST_ROWS)
    used = response.time.size // per * per
    time, value = (a[:used].reshape(-1, per).mean(axis=1) for a in (response.time, response.value))
    return Signal(time, value)


def _rows(driver: Signal, response: Signal, offset: float, relation: Relation) -> tuple[Floats, Floats]:
    """Regressors (n, k) and response (n,) where both are known."""
    shifted = response.time - offset
    inside = (shifted >= driver.time[0]) & (shifted <= driver.time[-1])
    x, y = driver.at(shifted[inside]), response.value[inside]
    ones = np.ones_like(x)
    if relation == "same":
        return np.column_stack([ones, x]), y
    return np.column_stack([ones, np.maximum(x, 0.0) ** 2, -(np.minimum(x, 0.0) ** 2)]), y


def _left(driver: Signal, response: Signal, offset: float, relation: Relation) -> float:
    """Share of the response's variance that is not explained; 1 where it would go against the driver."""
    H, y = _rows(driver, response, offset, relation)
    total = float(np.sum((y - y.mean()) ** 2)) if y.size > H.shape[1] else 0.0
    if total == 0:
        return 1.0
    theta = np.linalg.lstsq(H, y, rcond=None)[0]
    e = y - H @ theta
    return 1.0 if np.any(theta[1:] < 0) else float(e @ e) / total


def _rival(left: Floats, best: int) -> int | None:
    """Another offset that fits about as well, outside the valley of the best one."""
    rim = 0.5 * (float(left[best]) + 1.0)
    low = high = best
    while low > 0 and left[low - 1] < rim:
        low -= 1
    while high < left.size - 1 and left[high + 1] < rim:
        high += 1
    others = np.concatenate([np.arange(low), np.arange(high + 1, left.size)])
    if not others.size:
        return None
    second = int(others[np.argmin(left[others])])
    return second if left[second] < min(ALIKE * max(float(left[best]), 0.02), 0.9) else None


def _refined(driver: Signal, response: Signal, relation: Relation, at: float, step: float) -> ClockOffset:
    offsets = at + step * np.arange(-FINER, FINER + 1) / FINER
    sums = [_sums(*_rows(driver, response, offset, relation)) for offset in offsets.tolist()]
    found = _lowest(offsets, np.array([_residual(*(part.sum(axis=0) for part in s)) for s in sums]))
    without = [
        _lowest(offsets, np.array([_residual(*(np.delete(part, k, axis=0).sum(axis=0) for part in s)) for s in sums]))
        for k in range(BLOCKS)
    ]
    spread = float(np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((np.array(without) - np.mean(without)) ** 2)))
    grain = _grain(driver, response)
    shifted = driver.time[[0, -1]] + found
    overlap = min(shifted[1], response.time[-1]) - max(shifted[0], response.time[0])
    share = 1 - _left(driver, response, found, relation)
    return ClockOffset(found, float(np.hypot(spread, grain)), share, float(overlap))


def _grain(driver: Signal, response: Signal) -> float:
    """s, standard deviation of what sampling leaves open: the finer spacing; of a logged command its own too."""
    ours, theirs = (float(np.median(np.diff(s.time))) for s in (driver, response))
    return float(np.hypot(min(ours, theirs), ours if _logged(driver) else 0.0) / np.sqrt(12.0))


def _sums(H: Floats, y: Floats) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """H'H (BLOCKS, k, k), H'y (BLOCKS, k) and y'y (BLOCKS,) of contiguous blocks of rows."""
    blocks = list(zip(np.array_split(H, BLOCKS), np.array_split(y, BLOCKS), strict=True))
    return (
        np.array([h.T @ h for h, _ in blocks]),
        np.array([h.T @ v for h, v in blocks]),
        np.array([v @ v for _, v in blocks]),
    )


def _residual(G: Floats, h: Floats, yy: Floats) -> float:
    return float(yy - h @ np.linalg.lstsq(G, h, rcond=None)[0])


def _lowest(offsets: Floats, residual: Floats) -> float:
    """Middle of the lowest residuals: a command that is held makes them a plateau."""
    low = float(residual.min())
    return float(offsets[residual <= low + 1e-9 * abs(low)].mean())
