"""What was read in each step of a calibration, as arrays, and the shapes of what a cell does beside its curve."""

from __future__ import annotations

from collections.abc import Sequence
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
        return Steps(self.force[keep], self.hung[keep], self.time[keep], self.value[keep], self.temperature[keep])


def levels(force: Floats, sign: int) -> int:
    """How many different loads of that direction there are, none not among them."""
    if force.size == 0:
        return 0
    most = float(np.max(np.abs(force)))
    found = np.sort(np.abs(force[force * sign > SAME_LEVEL * most]))
    return int(found.size and 1 + np.count_nonzero(np.diff(found) > SAME_LEVEL * most))


def lag_shape(force: Floats) -> Floats:
    """(n,): +1 in the middle of a range that was reached upward, -1 downward; nothing at its ends, where loops close.

    Upward is towards forward thrust; a repetition of the same load keeps the way of the one before.

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


def crept(force: Floats, hung: Floats, time: Floats, time_constant: float) -> Floats:
    """(n, w) N: what a slow part of that time constant (s) holds at `time` (n, w), of a cell that was empty before."""
    start = [0.0]
    for (load, begun), (_, next_begun) in pairwise(zip(force, hung, strict=True)):
        start.append(float(load + (start[-1] - load) * np.exp(-(next_begun - begun) / time_constant)))
    held = force[:, None]
    out: Floats = held + (np.array(start)[:, None] - held) * np.exp(-(time - hung[:, None]) / time_constant)
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


def joined_steps(parts: Sequence[tuple[float, float, Floats, Floats, float]]) -> Steps:
    """From (force, time of loading, window times, window readings, temperature) of each step."""
    width = len(parts[0][2]) if parts else 1
    return Steps(
        np.array([part[0] for part in parts]),
        np.array([part[1] for part in parts]),
        np.array([part[2] for part in parts]).reshape(len(parts), width),
        np.array([part[3] for part in parts]).reshape(len(parts), width),
        np.array([part[4] for part in parts]),
    )
