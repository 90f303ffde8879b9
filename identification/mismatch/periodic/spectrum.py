"""Spectra of residuals at full rate: uneven sampling, gaps, several runs; and the level of the noise round each line.

The transform of uneven samples is that of their sums in narrow cells (nearest cell, error below 6 per cent of power);
the noise is the median of the neighbours, which a line does not move (mean of an exponential = median / ln 2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

from identification.estimation.tails import fisher_sf
from identification.mismatch import policy
from identification.recording import Floats
from identification.run_history.converter import Converter

OVERSAMPLING = 2
"""Frequencies per 1/T: between two of them at most a tenth of the power is lost."""
CELLS = 8
"""Cells per sample, or per period of the highest frequency, where sampling is uneven."""
EVEN = 0.05
"""Of the spacing: samples nearer than this to an even grid lie on it."""
NEAR, FAR = 24, 96
"""Independent neighbours whose median is the noise: the higher of both is taken, so that slopes and peaks count."""
INSTANT = Converter()
MEDIAN_WORTH = 0.48
"""Relative efficiency of the median of exponential variates: (ln 2)^2."""


@dataclass(frozen=True, eq=False)
class Series:
    """The residual of one run at the recording's own samples."""

    time: Floats
    """(n,) s, ascending."""
    residual: Floats
    """(n,) N, measured minus predicted; NaN is left out."""
    turns: Floats | None = None
    """(n,) angle turned since the start, never falling: rev, or V s (integral of |x|) where no rate was measured."""
    converter: Converter = INSTANT
    """What made the samples of the force."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Power over an even grid of frequencies k * step (k = 0, 1, ...), in the square of the residual's unit."""

    step: float
    power: Floats
    """|sum r exp(-2 pi i f t)|^2 / n: white noise of variance s^2 has mean s^2."""
    noise: Floats
    """Expected power of the noise there."""


def finite(series: Series) -> Series:
    """The samples of which residual, time and turns are numbers, and of those at one time the first."""
    good = np.isfinite(series.residual) & np.isfinite(series.time)
    if series.turns is not None:
        good &= np.isfinite(series.turns)
    good[good] = np.diff(series.time[good], prepend=-np.inf) > 0
    turns = None if series.turns is None else series.turns[good]
    return replace(series, time=series.time[good], residual=series.residual[good], turns=turns)


def clipped(residual: Floats) -> Floats:
    """Without its median, cut at SPECTRUM_CLIP robust standard deviations."""
    left = residual - np.median(residual)
    size = 1.4826 * float(np.median(np.abs(left)))
    out: Floats = (
        np.clip(left, -policy.periodic.SPECTRUM_CLIP * size, policy.periodic.SPECTRUM_CLIP * size) if size > 0 else left
    )
    return out


def spacing_of(time: Floats) -> tuple[float, bool]:
    """Median spacing in s, and whether all samples lie on a grid of it (gaps allowed)."""
    step = float(np.median(np.diff(time)))
    index = np.round((time - time[0]) / step)
    if index[-1] < 1:
        return step, False
    slope = float(index @ (time - time[0]) / (index @ index))
    off = np.abs(time - time[0] - slope * np.round((time - time[0]) / slope))
    return slope, bool(np.max(off) < EVEN * slope)


def transform(at: Floats, value: Floats, cell: float, length: int) -> NDArray[np.complex128]:
    """Sum of value exp(-2 pi i f (at - at[0])) at f = k / (length cell), from cells of width `cell`."""
    index = np.round((at - at[0]) / cell).astype(np.intp)
    cells = np.bincount(index, weights=value, minlength=length)
    out: NDArray[np.complex128] = rfft(cells[:length])
    return out


def level(power: Floats, independent: float) -> Floats:
    """Noise at each frequency: medians of blocks of NEAR and of FAR independent neighbours, the higher of the two.

    `independent`: frequencies of the grid per independent one.
    """
    out = np.zeros_like(power)
    for width in (NEAR, FAR):
        block = max(int(width * independent), 4)
        count = max(power.size // block, 1)
        size = power.size // count
        medians = np.median(power[: count * size].reshape(count, size), axis=1) / np.log(2)
        medians = np.maximum(medians, 1e-300)
        middle = (np.arange(count) + 0.5) * size
        out = np.maximum(out, np.exp(np.interp(np.arange(power.size), middle, np.log(medians))))
    return out


def averaged(value: Floats, rate: float, segment: int) -> tuple[Floats, Floats]:
    """Frequencies in Hz and one-sided power density of even samples at `rate` per s: Hann windows of `segment` samples,
    each without its mean, half over one another (Welch, IEEE Trans. Audio 15, 70, 1967)."""
    segment = min(segment, value.size)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(segment) / segment)
    starts = np.arange(0, value.size - segment + 1, segment - segment // 2)
    parts = np.lib.stride_tricks.sliding_window_view(value, segment)[starts]
    power = np.abs(rfft((parts - parts.mean(axis=1, keepdims=True)) * window)) ** 2
    density: Floats = power.mean(axis=0) / (rate * float(window @ window))
    density[1 : (segment + 1) // 2] *= 2
    frequency: Floats = np.arange(density.size, dtype=np.float64) * (rate / segment)
    return frequency, density


def smoothed(value: Floats, width: float) -> Floats:
    """Mean weighted by a Gaussian of `width` samples, cut at four of them; the ends go on as they are."""
    reach = int(4.0 * width + 0.5)
    weight = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    padded = np.concatenate([np.full(reach, value[0]), value, np.full(reach, value[-1])])
    length = next_fast_len(padded.size + 2 * reach, real=True)
    both = irfft(rfft(padded, length) * rfft(weight / weight.sum(), length), length)
    out: Floats = both[2 * reach : 2 * reach + value.size]
    return out


def spectrum_of(series: Series, longest: float, spacing: float, *, even: bool) -> Spectrum:
    """Of one run, on the grid of the longest run (s) so that spectra of several runs can be added."""
    cell = spacing if even else spacing / CELLS
    length = next_fast_len(OVERSAMPLING * (int(np.ceil(longest / cell)) + 2), real=True)
    found = transform(series.time, clipped(series.residual), cell, length)
    step = 1.0 / (length * cell)
    highest = int(0.5 / spacing / step)
    power = np.abs(found[: highest + 1]) ** 2 / series.time.size
    own = float(series.time[-1] - series.time[0]) or longest
    return Spectrum(step, power, level(power, 1.0 / (own * step)))


def tail(mean_ratio: float, parts: float, neighbours: float) -> float:
    """P(mean of `parts` ratios of power to noise exceeds this): Fisher's F, for the noise is estimated too."""
    return float(fisher_sf(mean_ratio, 2 * parts, 2 * MEDIAN_WORTH * neighbours * parts))


def family_wise(single: float, ratio: float, trials: float) -> float:
    """Of the largest of a continuum of `trials` independent frequencies (Baluev, MNRAS 385, 1279, 2008, eq. 6)."""
    expected = single * trials * np.sqrt(max(ratio, 1.0))
    return float(-np.expm1(-expected))
