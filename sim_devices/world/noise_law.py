"""Noise of one channel as a law: drawn by seed, and known well enough for an oracle to whiten it exactly.

A law is the sum of independent parts: white (Gaussian or Student t), white in proportion to |value|, first-order
Gauss-Markov processes (one: correlated, or slower than a hold; several in a ladder: 1/f) and one narrow AR(2) peak.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, exp, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Slow:
    """First-order Gauss-Markov process."""

    std: float
    time_constant: float
    """s."""


@dataclass(frozen=True, slots=True)
class Peak:
    """Narrow AR(2) peak: poles at radius exp(-pi width / rate), angle 2 pi frequency / rate."""

    std: float
    frequency: float
    """Hz."""
    width: float
    """Hz, full width at half power of a narrow peak."""


@dataclass(frozen=True, slots=True)
class NoiseLaw:
    """Standard deviations in the channel's unit."""

    white: float
    proportional: float = 0.0
    """relative: white noise of this fraction of |value|."""
    tails: float = 0.0
    """Degrees of freedom of Student's t for the white parts, above 2, of the same standard deviation; 0: Gaussian."""
    slow: tuple[Slow, ...] = ()
    peak: Peak | None = None

    def __post_init__(self) -> None:
        if min(self.white, self.proportional, *(s.std for s in self.slow), 0.0) < 0.0:
            raise ValueError("a standard deviation of noise must not be negative")
        if self.tails and self.tails <= 2.0:
            raise ValueError(f"tails must be above 2 degrees of freedom (finite variance), got {self.tails!r}")

    def white_std(self, value: Floats) -> Floats:
        """Of the white part at each value (n,)."""
        return np.sqrt(self.white**2 + (self.proportional * value) ** 2)


def scaled(law: NoiseLaw, factor: float) -> NoiseLaw:
    """The same law, `factor` times as loud."""
    return replace(
        law,
        white=law.white * factor,
        proportional=law.proportional * factor,
        slow=tuple(replace(s, std=s.std * factor) for s in law.slow),
        peak=law.peak and replace(law.peak, std=law.peak.std * factor),
    )


def flicker(std: float, longest: float, shortest: float) -> tuple[Slow, ...]:
    """1/f noise of standard deviation `std` between the time constants (s): a ladder, a decade a rung.

    Equal variances at time constants in geometric progression add up to 1/f within 6 % between the outer corners.
    """
    rungs = max(int(np.ceil(np.log10(longest / shortest))) + 1, 2)
    return tuple(Slow(std / sqrt(rungs), float(t)) for t in np.geomspace(longest, shortest, rungs))


def peak_coefficients(peak: Peak, rate: float) -> tuple[float, float, float]:
    """(a, b, innovation std) of x_t = a x_{t-1} + b x_{t-2} + e at `rate` samples/s."""
    radius = exp(-pi * peak.width / rate)
    a, b = 2.0 * radius * cos(2.0 * pi * peak.frequency / rate), -radius * radius
    variance = (1.0 - b) / ((1.0 + b) * ((1.0 - b) ** 2 - a * a))  # of x for a unit innovation
    return a, b, peak.std / sqrt(variance)


def drawn(law: NoiseLaw, value: Floats, rate: float, rng: np.random.Generator) -> Floats:
    """Noise of each sample of `value` (n,), taken at `rate` samples/s."""
    n = value.size
    unit = rng.standard_normal(n)
    if law.tails:
        unit = rng.standard_t(law.tails, n) * sqrt((law.tails - 2.0) / law.tails)
    total = law.white_std(value) * unit
    for slow in law.slow:
        keep = exp(-1.0 / (rate * slow.time_constant))
        pushes = slow.std * rng.standard_normal(n)
        pushes[1:] *= sqrt(1.0 - keep * keep)
        total += lfilter([1.0], [1.0, -keep], pushes)
    if law.peak:
        a, b, push = peak_coefficients(law.peak, rate)
        settle = int(10.0 * rate / law.peak.width)  # 10 decay times: what the start was is gone
        total += lfilter([1.0], [1.0, -a, -b], push * rng.standard_normal(n + settle))[settle:]
    return np.asarray(total, dtype=np.float64)


def spectrum(law: NoiseLaw, frequency: Floats, rate: float) -> Floats:
    """One-sided power density (unit^2/Hz) of the stationary part at each frequency (Hz) when sampled at `rate`."""
    z = np.exp(-2j * pi * frequency / rate)
    density = np.full(frequency.shape, law.white**2)
    for slow in law.slow:
        keep = exp(-1.0 / (rate * slow.time_constant))
        density += slow.std**2 * (1.0 - keep * keep) / np.abs(1.0 - keep * z) ** 2
    if law.peak:
        a, b, push = peak_coefficients(law.peak, rate)
        density += push**2 / np.abs(1.0 - a * z - b * z * z) ** 2
    return np.asarray(2.0 * density / rate)
