"""Residuals cut into stretches of steady turning, with the noise that they have at any order of the rotor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from identification.mismatch import policy
from identification.mismatch.periodic.spectrum import Series, averaged, clipped, smoothed, spacing_of
from identification.recording import Floats
from identification.run_history.converter import Converter

SMOOTH = 0.25
"""s, standard deviation of the Gauss mean that is taken off: what a model leaves is slow, and has aliases too."""
LONGEST = 8.0
"""s of one stretch."""
QUANTILES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Of the speeds of a stretch, over which the noise is averaged."""


class Colour:
    """The noise of one run over frequency, at the resolution of a stretch (Welch, IEEE Trans. AU-15, 70, 1967).

    `line` (n,): what is known of the residual to be none.
    """

    def __init__(self, series: Series, line: Floats) -> None:
        spacing, _ = spacing_of(series.time)
        self._index = np.round((series.time - series.time[0]) / spacing).astype(np.intp)
        self._grid, noise = np.zeros((2, int(self._index[-1]) + 1))
        self._grid[self._index] = quick(series, series.residual)
        noise[self._index] = quick(series, series.residual - line)
        segment = min(max(int(LONGEST / spacing), policy.periodic.STRETCH_SAMPLES), noise.size)
        self._rate = 1.0 / spacing
        self._f, density = averaged(noise, self._rate, segment)
        density[0] = density[min(1, density.size - 1)]
        if segment % 2 == 0:
            density[-1] *= 2.0  # one-sided density counts the highest frequency once, a turning phase sees it whole
        self._density = np.maximum(density, 1e-9 * float(density.max()) + 1e-300)

    def whitened(self) -> Floats:
        """(n,) the residual without what is slow, as white as this noise allows, phases kept: of variance 1."""
        length = next_fast_len(2 * self._grid.size, real=True)
        f = np.arange(length // 2 + 1) * (self._rate / length)
        white = rfft(self._grid, length) / np.sqrt(0.5 * self._rate * np.interp(f, self._f, self._density))
        out: Floats = irfft(white, length)[self._index]
        return out

    def seen(self, z: Floats, speed: float) -> Floats:
        """Hz at which the samples show z times this speed."""
        out: Floats = np.abs(z * speed - self._rate * np.round(z * speed / self._rate))
        return out

    def variance(self, z: float, speeds: Floats) -> float:
        """Of white noise as loud as this at z times these speeds."""
        return 0.5 * self._rate * float(np.mean(np.interp(self.seen(speeds, z), self._f, self._density)))

    def out_of(self, power: Floats, z: Floats, speeds: Floats) -> Floats:
        """Power over the noise at z times these speeds (aliases folded back), 1 on average; 1 where that is slow."""
        expected, usual = np.zeros_like(power), np.ones(power.shape, dtype=bool)
        for speed in speeds.tolist():
            seen = self.seen(z, speed)
            expected += np.interp(seen, self._f, self._density)
            usual &= seen > policy.periodic.SLOWEST_STRETCH_WAVE
        ratio = power / expected
        middle = float(np.median(ratio[usual])) / np.log(2) if usual.any() else 0.0
        out: Floats = np.where(usual, ratio / middle, 1.0) if middle > 0 else np.ones_like(ratio)
        return out


@dataclass(frozen=True, eq=False)
class SteadySegment:
    """n samples of one run during which the rotor hardly changes its speed: their turns, and what the model left."""

    run: int
    time: Floats
    turns: Floats
    value: Floats
    """N, without what is slow."""
    white: Floats
    """The same, whitened, of variance 1."""
    speeds: Floats
    """Turns per s, QUANTILES of it."""
    colour: Colour
    converter: Converter
    turning: Floats
    """(n,) turns per s."""
    weight: NDArray[np.complex128]
    """(n,) what each sample has of a wave of one size and phase at the highest speed."""

    @property
    def information(self) -> float:
        """Samples, each by what it holds of a wave."""
        return float(np.sum(np.abs(self.weight) ** 2))

    @property
    def speed(self) -> float:
        return float(self.speeds.mean())

    def trend(self, least: float) -> int:
        """0 while the rotor keeps its speed to a share of `least`, 1 while it becomes faster, 2 slower."""
        middle = self.time.size // 2
        first, last = (
            float(np.ptp(self.turns[s]) / max(np.ptp(self.time[s]), 1e-300))
            for s in (slice(None, middle), slice(middle, None))
        )
        change = (last - first) / max(first, last, 1e-300)
        return 0 if abs(change) < least else 1 if change > 0 else 2

    def wave(self, z: float) -> complex:
        """Sum of white exp(-2 pi i z turns), each by its weight.

        Whitened, for a loud resonance leaks into all frequencies of a stretch.
        """
        return complex((np.conj(self.weight) * self.white) @ np.exp(-2j * np.pi * z * self.turns))


def quick(series: Series, residual: Floats) -> Floats:
    """A residual of this run without what is slower than about 1/(4 SMOOTH)."""
    value = clipped(residual)
    spacing, _ = spacing_of(series.time)
    out: Floats = value - smoothed(value, SMOOTH / spacing)
    return out


def speed_of(series: Series) -> Floats:
    """Turns per s at each sample."""
    assert series.turns is not None
    out: Floats = np.gradient(series.turns, series.time)
    return out


def stretches(runs: Sequence[tuple[int, Series]], top: float, lines: Sequence[Floats] = ()) -> Iterator[SteadySegment]:
    """Of all runs, in which the rotor turns without a step of its speed; `top`: highest speed, turns per s.

    `lines`: what is known to be no noise, run for run.
    """
    for (i, r), line in zip(runs, lines or [np.zeros(r.time.size) for _, r in runs], strict=True):
        assert r.turns is not None
        speed, colour = speed_of(r), Colour(r, line)
        value, white = quick(r, r.residual), colour.whitened()
        for low, high in pairwise(_edges(r.time, speed, top)):
            s = slice(low, high)
            if (
                high - low >= policy.periodic.STRETCH_SAMPLES
                and speed[s].mean() > policy.periodic.STRETCH_TURNING * top
                and np.any(value[s])
            ):
                speeds, alike = np.quantile(speed[s], QUANTILES), np.ones(high - low, dtype=np.complex128)
                yield SteadySegment(
                    i, r.time[s], r.turns[s], value[s], white[s], speeds, colour, r.converter, speed[s], alike
                )


def _edges(time: Floats, speed: Floats, top: float) -> list[int]:
    piece = np.floor((time - time[0]) / LONGEST)
    new: NDArray[np.bool_] = (np.abs(np.diff(speed)) > policy.periodic.STRETCH_SPEED_JUMP * top) | (np.diff(piece) > 0)
    new |= np.diff(speed > policy.periodic.STRETCH_TURNING * top)
    return [0, *(np.flatnonzero(new) + 1).tolist(), speed.size]
