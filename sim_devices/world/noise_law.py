"""Noise of one channel as a law: drawn by seed, and known well enough for an oracle to whiten it exactly.

A law is the sum of independent parts: white (Gaussian or Student t), white in proportion to |value|, first-order
Gauss-Markov processes (one: correlated, or slower than a hold; several in a ladder: 1/f), one AR(2) peak, and
correlated unrest after changes of the value. A law may also say by what quantum the reading is rounded.
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
class Unrest:
    """Water that has not settled: first-order Gauss-Markov noise of the size share |value - its mean of late|.

    After a step of the value it is `share` of the step and dies with `decay`.
    """

    share: float
    decay: float
    """s, of the running mean with exponential weights that the value is compared with."""
    time_constant: float
    """s, of the noise itself."""

    def size(self, value: Floats, rate: float) -> Floats:
        """Standard deviation at each value (n,) sampled at `rate` (1/s)."""
        keep = exp(-1.0 / (rate * self.decay))
        late, _ = lfilter([1.0 - keep], [1.0, -keep], value, zi=[keep * value[0]])
        return np.asarray(self.share * np.abs(value - late) / keep)


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
    unrest: Unrest | None = None
    quantum: float = 0.0
    """The reading with its noise is rounded to whole multiples of it; 0: it is not."""

    def __post_init__(self) -> None:
        if min(self.white, self.proportional, *(s.std for s in self.slow), 0.0) < 0.0:
            raise ValueError("a standard deviation of noise must not be negative")
        if self.quantum < 0.0 or (self.unrest and min(self.unrest.share, self.unrest.decay) <= 0.0):
            raise ValueError("a quantum must not be negative, unrest must have a share and a decay above zero")
        if self.tails and self.tails <= 2.0:
            raise ValueError(f"tails must be above 2 degrees of freedom (finite variance), got {self.tails!r}")

    def white_std(self, value: Floats) -> Floats:
        """Of the white part at each value (n,), rounding taken as white (Widrow and Kollar 2008: q^2 / 12)."""
        return np.sqrt(self.white**2 + (self.proportional * value) ** 2 + self.quantum**2 / 12.0)


def scaled(law: NoiseLaw, factor: float) -> NoiseLaw:
    """The same law, `factor` times as loud."""
    return replace(
        law,
        white=law.white * factor,
        proportional=law.proportional * factor,
        slow=tuple(replace(s, std=s.std * factor) for s in law.slow),
        peak=law.peak and replace(law.peak, std=law.peak.std * factor),
        unrest=law.unrest and replace(law.unrest, share=law.unrest.share * factor),
        quantum=law.quantum * factor,
    )


def stationary(law: NoiseLaw, value: Floats, rate: float) -> NoiseLaw:
    """A law of one size throughout, with the mean power that `law` has over a run of `value` (n,)."""
    slow = law.slow
    if law.unrest:
        mean = float(np.sqrt(np.mean(law.unrest.size(value, rate) ** 2)))
        slow = (*slow, Slow(mean, law.unrest.time_constant))
    white = float(np.sqrt(np.mean(law.white_std(value) ** 2)))
    return replace(law, white=white, proportional=0.0, slow=slow, unrest=None, quantum=0.0)


def rounded(law: NoiseLaw, value: Floats) -> Floats:
    """The reading (n,) as its converter gives it."""
    return np.asarray(law.quantum * np.round(value / law.quantum)) if law.quantum else value


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
    """Noise of each sample of `value` (n,), taken at `rate` samples/s, before anything is rounded."""
    n = value.size
    unit = rng.standard_normal(n)
    if law.tails:
        unit = rng.standard_t(law.tails, n) * sqrt((law.tails - 2.0) / law.tails)
    total = replace(law, quantum=0.0).white_std(value) * unit
    for slow in law.slow:
        total += _markov(slow, n, rate, rng)
    if law.unrest:
        total += law.unrest.size(value, rate) * _markov(Slow(1.0, law.unrest.time_constant), n, rate, rng)
    if law.peak:
        a, b, push = peak_coefficients(law.peak, rate)
        settle = int(10.0 * rate / law.peak.width)  # 10 decay times: what the start was is gone
        total += lfilter([1.0], [1.0, -a, -b], push * rng.standard_normal(n + settle))[settle:]
    return np.asarray(total, dtype=np.float64)


def _markov(slow: Slow, n: int, rate: float, rng: np.random.Generator) -> Floats:
    keep = exp(-1.0 / (rate * slow.time_constant))
    pushes = slow.std * rng.standard_normal(n)
    pushes[1:] *= sqrt(1.0 - keep * keep)
    return np.asarray(lfilter([1.0], [1.0, -keep], pushes))


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
