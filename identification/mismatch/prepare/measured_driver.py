"""A driver that was measured, not told: how noisy it is, where it jumps, and when it is known between its samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.prepare.adaptive_smoothing import Level, smoothed
from identification.recording import Floats

MOST = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Times that: what is allowed where too little would be left."""
INSTANT = 1e-6
"""Of the time between two samples: how long a jump is made to take."""


@dataclass(frozen=True, eq=False, slots=True)
class Measured:
    """Samples of a driver, without most of their noise."""

    time: Floats
    value: Floats
    jumped: NDArray[np.bool_]
    """(n-1,) whether it went to another level between two samples."""
    noise: float
    """Standard deviation of a sample as it was read, in the driver's unit."""
    error: Floats
    """(n,) standard error of `value`, beside that of a level."""
    levels: tuple[Level, ...]
    """Where it stood still; of a driver without noise none."""
    loud: bool

    @property
    def jumps(self) -> Floats:
        """s: half way between the two samples."""
        out: Floats = 0.5 * (self.time[1:] + self.time[:-1])[self.jumped]
        return out

    def with_jumps(self) -> tuple[Floats, Floats]:
        """The samples, and on either side of each jump the level there."""
        at = np.flatnonzero(self.jumped)
        half = 0.5 * INSTANT * (self.time[at + 1] - self.time[at])
        index = np.repeat(at + 1, 2)
        when = np.column_stack([self.jumps - half, self.jumps + half]).ravel()
        value = np.column_stack([self.value[at], self.value[at + 1]]).ravel()
        return np.insert(self.time, index, when), np.insert(self.value, index, value)

    def at(self, time: Floats) -> Floats:
        """(N,) the driver at each time."""
        return np.asarray(np.interp(time, *self.with_jumps()), dtype=np.float64)

    def known(self, time: Floats, force: Floats) -> NDArray[np.bool_]:
        """(N,) whether the driver is known so well that the thrust samples `force` in N do not show its error; where
        that would leave too little, those that show it least."""
        if self.time.size < 2:
            return np.ones(time.size, dtype=bool)
        n = self.at(time)
        beside = n * np.abs(n) - np.mean(n * np.abs(n))
        C = abs(float(beside @ force)) / max(float(beside @ beside), 1e-300)
        size, noise = float(np.max(np.abs(self.value))), noise_of(force)
        stray, error = self._astray(time), np.interp(time, self.time, self.error)
        slope = 2 * C * (np.abs(n) + stray)
        least = policy.prepare.DRIVER_ERROR_UNSEEN * C * size**2
        much = slope * np.maximum(
            stray / max(policy.prepare.STRAIGHT_LINE_UNSEEN * noise, least),
            error / max(policy.prepare.DRIVER_NOISE_UNSEEN * noise, least),
        )
        for most in MOST:
            told: NDArray[np.bool_] = much <= most
            if np.count_nonzero(told) > policy.prepare.SAMPLES_LEFT * time.size:
                return told
        return np.ones(time.size, dtype=bool)

    def _astray(self, at: Floats) -> Floats:
        """(N,) by how much the straight lines between the samples may be off, in the driver's unit."""
        gap = np.clip(np.searchsorted(self.time, at, side="right") - 1, 0, self.time.size - 2)
        share = np.clip((at - self.time[gap]) / (self.time[gap + 1] - self.time[gap]), 0.0, 1.0)
        step = np.diff(self.value)
        bend = np.where(self.jumped[1:] | self.jumped[:-1], 0.0, np.abs(np.diff(step)))
        bent = np.maximum(np.append(bend, 0.0), np.append(0.0, bend))
        across = np.where(np.minimum(share, 1 - share) > policy.prepare.SAMPLE_INSTANT, np.abs(step[gap]), 0.0)
        out: Floats = np.where(self.jumped[gap], across, 0.5 * share * (1 - share) * bent[gap])
        return out


def measured(time: Floats, value: Floats) -> Measured:
    """From the samples as they were read, at distinct times."""
    noise, size = noise_of(value), float(np.max(np.abs(value), initial=0.0))
    jumped = _jumped(value, noise, size)
    if noise <= policy.prepare.LOUD_DRIVER * size:
        return Measured(time, value, jumped, noise, np.zeros(value.size), (), loud=False)
    smooth = smoothed(time, value, jumped, noise)
    return Measured(time, smooth.value, jumped, noise, smooth.error, smooth.levels, loud=True)


def noise_of(value: Floats) -> float:
    """Standard deviation of a sample, robust: levels vanish in its differences, ramps in the second, slow sines in the
    third."""
    if value.size < 5:
        return 0.0
    return min(
        float(np.median(np.abs(np.diff(value, order)))) / 0.6745 / float(np.sqrt(squares))
        for order, squares in ((1, 2.0), (2, 6.0), (3, 20.0))
    )


def _jumped(value: Floats, noise: float, size: float) -> NDArray[np.bool_]:
    step = np.abs(np.diff(value))
    if step.size == 0:
        return np.zeros(0, dtype=bool)
    beside = np.maximum(np.append(step[1:], 0.0), np.append(0.0, step[:-1]))
    out: NDArray[np.bool_] = (
        step
        > max(policy.prepare.DRIVER_JUMP * size, policy.prepare.DRIVER_NOISE_SIGMA * noise)
        + policy.prepare.DRIVER_JUMP_ALONE * beside
    )
    return out
