"""Broad peaks in the spectrum of a residual: stands and cells that ring on their own, as damped oscillators of noise.

A peak is looked for in averaged spectra of several resolutions against the median of its surroundings, then frequency
and width are fitted by Whittle's likelihood (Ark. Mat. 2, 423, 1953). A damped oscillator of quality Q has a peak of
half width f/(2 Q) at half power: what `noise.Noise.bands` takes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import rfft

from identification.mismatch import policy
from identification.mismatch.periodic.spectrum import Series, averaged, clipped, finite, spacing_of
from identification.recording import Floats

MOST_BANDS = 2
"""Peaks of one averaged spectrum that are looked at, the clearest first."""
AVERAGES = (12, 40, 120, 400)
"""Stretches of a run over which spectra are averaged."""
SURROUNDINGS = 1.7
"""Factor of frequency on either side whose median is the background."""
KNOTS = 120
"""Frequencies at which the background is taken."""
POINTS = 300
"""Averaged powers in one fit."""


def find_bands(runs: Sequence[Series]) -> tuple[tuple[float, float], ...]:
    """(frequency in Hz, quality) of at most NOISE_BANDS broad peaks of noise, the strongest first.

    Take lines out first (`lines.find_lines`), and leave out samples just after steps (NaN).
    """
    usable = [r for r in map(finite, runs) if r.time.size >= policy.periodic.BAND_SAMPLES]
    if not usable:
        return ()
    grids = [_grid(r) for r in usable]
    found: list[tuple[float, float]] = []
    for f, width in _candidates(grids):
        if len(found) == policy.periodic.NOISE_BANDS:
            break
        if f < policy.periodic.LOWEST_BAND:
            continue
        fitted = _fitted(grids, f, width)
        if fitted is not None and all(abs(np.log(fitted[0] / g)) > 1.0 / q + 0.1 for g, q in found):
            found.append(fitted)
    return tuple(found)


def _grid(series: Series) -> tuple[Floats, float]:
    """Residual on an even grid, zero where there is none, and the spacing."""
    spacing, _ = spacing_of(series.time)
    index = np.round((series.time - series.time[0]) / spacing).astype(np.intp)
    out = np.zeros(int(index[-1]) + 1)
    out[index] = clipped(series.residual)
    return out, spacing


def _candidates(grids: Sequence[tuple[Floats, float]]) -> list[tuple[float, float]]:
    """(frequency, rough half width) of what stands out in averaged spectra, clearest first."""
    longest, spacing = max(grids, key=lambda g: g[0].size)
    seen = []
    for averages in AVERAGES:
        segment = 2 * longest.size // averages
        if segment < 64:
            continue
        f, density = averaged(longest, 1 / spacing, segment)
        f, density = f[3:-1], density[3:-1]
        knots = np.unique(np.geomspace(1, f.size, KNOTS).astype(np.intp)) - 1
        low = np.searchsorted(f, f[knots] / SURROUNDINGS)
        high = np.maximum(np.searchsorted(f, f[knots] * SURROUNDINGS), low + 1)
        medians = [float(np.median(density[a:b])) for a, b in zip(low, high, strict=True)]
        background = np.exp(np.interp(np.log(f), np.log(f[knots]), np.log(np.maximum(medians, 1e-300))))
        number = np.interp(f, f[knots], high - low)
        excess = density / background - 1
        error = 1.1 / np.sqrt(averages) * np.sqrt(1 + 2 / number)
        score = np.where(number >= 12, excess / error, 0.0)
        for _ in range(MOST_BANDS):
            i = int(np.argmax(score))
            if score[i] < policy.periodic.BAND_SIGMA or excess[i] < policy.periodic.BAND_EXCESS:
                break
            half = density > background[i] * (1 + 0.5 * excess[i])
            left = i - int(np.argmin(half[i::-1]))
            right = i + int(np.argmin(half[i:]))
            seen.append((float(score[i]), float(f[i]), float(max(right - left, 1) * f[0] / 3 * 0.5)))
            score[(f > f[i] / 1.3) & (f < f[i] * 1.3)] = 0.0
    return [(f, w) for _, f, w in sorted(seen, reverse=True)]


def _powers(grids: Sequence[tuple[Floats, float]], low: float, high: float) -> tuple[Floats, Floats, Floats, float]:
    """Frequencies, mean powers and how many each is a mean of, from `low` to `high` Hz; and 1/T of the longest run."""
    f_all, power_all, count_all, finest = [], [], [], np.inf
    for grid, spacing in grids:
        power = np.abs(rfft(grid)) ** 2 / max(np.count_nonzero(grid), 1)
        step = 1.0 / (grid.size * spacing)
        finest = min(finest, step)
        first, last = max(int(low / step), 1), min(int(high / step), power.size - 1)
        if last - first < 8:
            continue
        size = max((last - first) // POINTS, 1)
        blocks = (last - first) // size
        cut = power[first : first + blocks * size].reshape(blocks, size)
        f_all.append((first + (np.arange(blocks) + 0.5) * size - 0.5) * step)
        power_all.append(cut.mean(axis=1))
        count_all.append(np.full(blocks, float(size)))
    empty = np.empty(0)
    join = [np.concatenate(x) if x else empty for x in (f_all, power_all, count_all)]
    return join[0], join[1], join[2], finest


def _fitted(grids: Sequence[tuple[Floats, float]], f0: float, width: float) -> tuple[float, float] | None:
    """Frequency and quality of the peak near `f0` (Hz), None where a sloping floor does as well or it is a line."""
    from scipy.optimize import minimize  # a quarter of a second, and few recordings come here

    reach = min(max(10 * width, 0.1 * f0), 0.7 * f0)
    f, power, count, finest = _powers(grids, f0 - reach, f0 + reach)
    if f.size < 16:
        return None
    floor = float(np.median(power))
    x = (f - f0) / reach

    def cost(q: Floats) -> float:
        density = np.exp(q[0] + q[1] * x)
        if q.size > 2:
            density = density + np.exp(q[2]) / (1 + ((f - q[3]) / np.exp(q[4])) ** 2)
        return float(2 * np.sum(count * (np.log(density) + power / density)))

    plain = minimize(cost, np.array([np.log(floor), 0.0]), method="L-BFGS-B", bounds=[(None, None), (-8, 8)])
    best = None
    for factor in (0.3, 1.0, 3.0):
        start = np.array([np.log(floor), 0.0, np.log(max(float(power.max()), floor)), f0, np.log(factor * width)])
        level = np.log(max(float(power.max()), 1e-300))
        bounds = [(level - 40, level + 9), (-8, 8), (level - 40, level + 9), (f0 - 0.5 * reach, f0 + 0.5 * reach)]
        widths = (np.log(0.3 * finest), np.log(2 * reach))
        now = minimize(cost, start, method="L-BFGS-B", bounds=[*bounds, widths])
        best = now if best is None or now.fun < best.fun else best
    assert best is not None
    half = float(np.exp(best.x[4]))
    if plain.fun - best.fun < policy.periodic.BAND_GAIN or half < policy.periodic.BAND_WIDTH * finest:
        return None
    centre = float(best.x[3])
    quality = centre / (2 * half)
    low, high = policy.periodic.LOWEST_BAND_QUALITY, policy.periodic.HIGHEST_BAND_QUALITY
    return (centre, quality) if low <= quality <= high else None
