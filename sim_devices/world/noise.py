"""Sensor noise: white, slow (first-order Gauss-Markov) and proportional to the value; seeded."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sqrt

import numpy as np

CHANNELS = (
    "thrust",
    "rotation_rate",
    "current",
    "bus_voltage",
    "input_current",
    "flow_speed",
    "water_temperature",
    "pressure",
    "motor_temperature",
    "fet_temperature",
)


@dataclass(frozen=True, slots=True)
class Noise:
    """`[noise.<channel>]`, standard deviations in the channel's unit."""

    white: float = 0.0
    slow: float = 0.0
    slow_time: float = 1.0
    """s: correlation time of the slow part."""
    proportional: float = 0.0
    """relative: white noise of this fraction of |value|."""

    def __post_init__(self) -> None:
        if min(self.white, self.slow, self.proportional) < 0 or self.slow_time <= 0:
            raise ValueError("noise must not be negative and slow_time must be positive")


class Normals:
    """Standard normal numbers one at a time, drawn in blocks: one draw costs as much as a world step."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._block: list[float] = []

    def draw(self) -> float:
        if not self._block:
            self._block = self._rng.standard_normal(1024).tolist()
        return self._block.pop()


class NoiseSource:
    """The noise of one channel, sampled at whatever times it is asked."""

    def __init__(self, noise: Noise, rng: np.random.Generator) -> None:
        self._noise = noise
        self._normals = Normals(rng)
        self._slow = noise.slow * self._normals.draw() if noise.slow else 0.0
        self._time = 0.0

    def sample(self, value: float, t: float) -> float:
        """Noise to add to `value` at time t (s)."""
        n = self._noise
        total = (n.white + n.proportional * abs(value)) * self._normals.draw()
        if n.slow:
            keep = exp(-max(t - self._time, 0.0) / n.slow_time)
            self._slow = keep * self._slow + n.slow * sqrt(1.0 - keep * keep) * self._normals.draw()
            self._time = t
            total += self._slow
        return total
