"""What was read in each step of a calibration, as arrays, and the shapes of what a cell does beside its curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

SAME_LEVEL = 1e-3
"""Of the largest force: loads that differ by less are one level."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Of n steps in the order in which they were taken. Every step has the same number w of windows, one at least."""

    force: Floats
    """(n,) N, applied."""
    hung: Floats
    """(n,) s, when the load was put on, on one clock."""
    time: Floats
    """(n, w) s, middle of each window."""
    value: Floats
    """(n, w) N, mean reading in it."""
    temperature: Floats
    """(n,) degC; NaN where nobody measured."""
    unread: tuple[tuple[float, float], ...] = ()
    """(s, N) of loads that hung and were not read: what the cell remembers of them is in the readings."""

    def __post_init__(self) -> None:
        n = self.force.size
        if self.time.shape != self.value.shape or self.time.ndim != 2 or self.time.shape[0] != n:
            raise ValueError(f"times {self.time.shape} and readings {self.value.shape} must both be ({n}, windows)")
        if self.hung.shape != (n,) or self.temperature.shape != (n,):
            raise ValueError(f"{n} steps need {n} times of loading and {n} temperatures (NaN: unknown)")
        if not (np.all(np.isfinite(self.force)) and np.all(np.isfinite(self.value)) and np.all(np.isfinite(self.time))):
            raise ValueError("forces, times and readings must be finite numbers")
        if np.any(np.diff(self.hung) < 0.0) or np.any(self.time < self.hung[:, None]):
            raise ValueError("steps must be in order of time, each read after its load was put on")

    @property
    def count(self) -> int:
        return int(self.force.size)

    @property
    def mean(self) -> Floats:
        """(n,) N"""
        out: Floats = self.value.mean(axis=1)
        return out

    @property
    def reach(self) -> float:
        """N, largest |force|; ValueError when nothing hung."""
        most = float(np.max(np.abs(self.force))) if self.count else 0.0
        if most == 0.0:
            raise ValueError("no step had a load: at least two loads that differ are needed to tell a gain")
        return most

    @property
    def age(self) -> float:
        """s, typical, from the loading to the reading."""
        return float(np.median(self.time.mean(axis=1) - self.hung))

    def without(self, keep: NDArray[np.bool_]) -> Steps:
        """Only the steps (n,) that are kept."""
        kept = (self.force[keep], self.hung[keep], self.time[keep], self.value[keep], self.temperature[keep])
        return Steps(*kept, self.unread)

    def history(self) -> tuple[Floats, Floats, NDArray[np.int64]]:
        """Forces (m,) and times (m,) of all loads in order, and the places (n,) of those that were read."""
        force = np.concatenate([self.force, [load for _, load in self.unread]])
        hung = np.concatenate([self.hung, [when for when, _ in self.unread]])
        order = np.argsort(hung, kind="stable")
        return force[order], hung[order], np.argsort(order, kind="stable")[: self.count]

    def of_history(self, shape: Callable[[Floats], Floats]) -> Floats:
        """(n,): a shape of the order of all loads, at those that were read."""
        force, _, at = self.history()
        return shape(force)[at]


def levels(force: Floats, sign: int) -> int:
    """How many different loads of that direction there are, none not among them."""
    if force.size == 0:
        return 0
    most = float(np.max(np.abs(force)))
    found = np.sort(np.abs(force[force * sign > SAME_LEVEL * most]))
    return int(found.size and 1 + np.count_nonzero(np.diff(found) > SAME_LEVEL * most))


def lag_shape(force: Floats) -> Floats:
    """(n,): +1 in the middle of a range that was reached upward, -1 downward; nothing at its ends, where loops close.

    Upward is towards forward thrust; a repetition of the same load keeps the way of the one before. The loop is that of
    a cell that has been loaded to the end of the range before in that direction.

    >>> lag_shape(np.array([0.0, 5.0, 10.0, 5.0, 10.0])).tolist()
    [0.0, 1.0, 0.0, -1.0, 0.0]
    """
    most = {sign: float(np.max(np.maximum(sign * force, 0.0), initial=0.0)) for sign in (1, -1)}
    out, way, before = np.zeros(force.size), 0.0, 0.0
    for k, each in enumerate(force):
        way = float(np.sign(each - before)) or way
        before = float(each)
        top = most[1 if each > 0.0 else -1]
        share = abs(float(each)) / top if top > 0.0 else 0.0
        out[k] = way * 4.0 * share * (1.0 - share)
    return out


def side_of(force: Floats) -> Floats:
    """(n,): the direction of the load, and without one that of the load before: a cell remembers what it was last.

    >>> side_of(np.array([0.0, 5.0, 0.0, -5.0, 0.0])).tolist()
    [0.0, 1.0, 1.0, -1.0, -1.0]
    """
    out, side = np.zeros(force.size), 0.0
    for k, each in enumerate(force):
        side = float(np.sign(each)) or side
        out[k] = side
    return out


def crept(steps: Steps, time_constant: float) -> Floats:
    """(n, w) N: what a slow part of that time constant (s) holds in each window, of a cell that was empty before."""
    force, hung, at = steps.history()
    start = [0.0]
    for (load, begun), (_, next_begun) in pairwise(zip(force, hung, strict=True)):
        start.append(float(load + (start[-1] - load) * np.exp(-(next_begun - begun) / time_constant)))
    held = steps.force[:, None]
    waned = np.exp(-(steps.time - steps.hung[:, None]) / time_constant)
    out: Floats = held + (np.array(start)[at][:, None] - held) * waned
    return out


def windows_of(time: Floats, value: Floats, start: float, count: int = 2) -> tuple[Floats, Floats]:
    """Middles (count,) in s and mean readings (count,) of equal parts of samples (m,) from `start` to the last.

    Raises ValueError for a part without a sample.
    """
    good = np.isfinite(value) & (time >= start)
    time, value = time[good], value[good]
    if time.size < count:
        raise ValueError(f"{time.size} readings are too few for {count} windows")
    parts = np.array_split(np.arange(time.size), count)
    return np.array([time[part].mean() for part in parts]), np.array([value[part].mean() for part in parts])


def joined_steps(
    parts: Sequence[tuple[float, float, Floats, Floats, float]], unread: Sequence[tuple[float, float]] = ()
) -> Steps:
    """From (force, time of loading, window times, window readings, temperature) of each step."""
    width = len(parts[0][2]) if parts else 1
    return Steps(
        np.array([part[0] for part in parts]),
        np.array([part[1] for part in parts]),
        np.array([part[2] for part in parts]).reshape(len(parts), width),
        np.array([part[3] for part in parts]).reshape(len(parts), width),
        np.array([part[4] for part in parts]),
        tuple(unread),
    )
