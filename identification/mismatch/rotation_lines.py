"""Lines locked to the rotor: a sin(2 pi z theta + p), theta the angle turned.

Theta is known well within a stretch of steady turning and less well across steps, so power is summed over stretches
with a phase of their own each; where one phase serves them all, the line is fitted as one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from identification.mismatch.spectrum import (
    CELLS,
    OVERSAMPLING,
    Series,
    averaged,
    clipped,
    family_wise,
    smoothed,
    spacing_of,
    transform,
)
from identification.recording import Floats
from identification.tails import chi2_sf, gamma_median, gamma_sf

HIGHEST = 400.0
"""Hz at the highest speed: blade pass of the fastest thrusters, with their harmonics."""
LOWEST = 1.0
"""Hz at the highest speed."""
SLOWEST = 1.0
"""Hz: what is slower in a stretch (or its alias) is no line."""
SMOOTH = 0.25
"""s, standard deviation of the Gauss mean that is taken off: what a model leaves is slow, and has aliases too."""
LEAST_GAIN = 25.0
"""In chi-square."""
LONGEST = 8.0
"""s of one stretch."""
LEAST = 24
"""Samples of a stretch."""
TURNING = 0.1
"""Share of the highest speed below which the rotor counts as at rest."""
JUMP = 0.04
"""Share of the highest speed: a change between samples that begins a new stretch."""
QUANTILES = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Of the speeds of a stretch, over which the noise is averaged."""
SPEEDS = 12
"""Groups of speed: no single one of them may carry a line that is locked to the rotor."""
ORDERS = 12
"""Whole ratios that are looked at."""
BESIDE = (-7, -6, -5, -4, 4, 5, 6, 7)
"""Independent ratios beside a line at which the noise is taken."""
COHERENT = 0.01
"""Probability below which what one phase loses of the power is no noise."""


@dataclass(frozen=True, eq=False)
class Locked:
    ratio: float
    ratio_std: float
    amplitude: float
    amplitude_std: float
    phase: float | None
    phase_std: float | None
    p_value: float
    gain: float
    speed: float
    """Mean speed of the turning rotor, turns per s."""
    parts: tuple[tuple[int, float, float, float, float], ...]
    """(run, start, end, a, b) of each stretch."""


@dataclass(frozen=True, eq=False)
class _Stretch:
    run: int
    time: Floats
    turns: Floats
    value: Floats
    speeds: Floats
    """Turns per s, QUANTILES of it."""

    @property
    def speed(self) -> float:
        return float(self.speeds.mean())


class _Colour:
    """The noise of one run over frequency, at the resolution of a stretch (Welch, IEEE Trans. AU-15, 70, 1967)."""

    def __init__(self, series: Series) -> None:
        spacing, _ = spacing_of(series.time)
        index = np.round((series.time - series.time[0]) / spacing).astype(np.intp)
        grid = np.zeros(int(index[-1]) + 1)
        grid[index] = _quick(series)
        segment = min(max(int(LONGEST / spacing), LEAST), grid.size)
        self._rate = 1.0 / spacing
        self._f, density = averaged(grid, self._rate, segment)
        density[0] = density[min(1, density.size - 1)]
        if segment % 2 == 0:
            density[-1] *= 2.0  # one-sided density counts the highest frequency once, a turning phase sees it whole
        self._density = np.maximum(density, 1e-9 * float(density.max()) + 1e-300)

    def out_of(self, power: Floats, z: Floats, speeds: Floats) -> Floats:
        """Power over the noise at z times these speeds (aliases folded back), 1 on average; 1 where that is slow."""
        expected, usual = np.zeros_like(power), np.ones(power.shape, dtype=bool)
        for speed in speeds.tolist():
            seen = np.abs(z * speed - self._rate * np.round(z * speed / self._rate))
            expected += np.interp(seen, self._f, self._density)
            usual &= seen > SLOWEST
        ratio = power / expected
        middle = float(np.median(ratio[usual])) / np.log(2) if usual.any() else 0.0
        out: Floats = np.where(usual, ratio / middle, 1.0) if middle > 0 else np.ones_like(ratio)
        return out


def _quick(series: Series) -> Floats:
    """The residual without what is slower than about 1/(4 SMOOTH)."""
    value = clipped(series.residual)
    spacing, _ = spacing_of(series.time)
    out: Floats = value - smoothed(value, SMOOTH / spacing)
    return out


def _speed(series: Series) -> Floats:
    """Turns per s at each sample."""
    assert series.turns is not None
    out: Floats = np.gradient(series.turns, series.time)
    return out


def _stretches(runs: Sequence[tuple[int, Series]], top: float) -> Iterator[_Stretch]:
    for i, r in runs:
        assert r.turns is not None
        speed = _speed(r)
        value = _quick(r)
        piece = np.floor((r.time - r.time[0]) / LONGEST)
        new = (np.abs(np.diff(speed)) > JUMP * top) | (np.diff(piece) > 0)
        new |= np.diff(speed > TURNING * top)
        edges = np.concatenate([[0], np.flatnonzero(new) + 1, [speed.size]])
        for low, high in pairwise(edges.tolist()):
            s = slice(low, high)
            if high - low >= LEAST and speed[s].mean() > TURNING * top and np.any(value[s]):
                yield _Stretch(i, r.time[s], r.turns[s], value[s], np.quantile(speed[s], QUANTILES))


def find_locked(runs: Sequence[tuple[int, Series]], alarm: float) -> Locked | None:
    """The most significant rotor-locked line; None without one."""
    top = max(float(np.quantile(_speed(r), 0.99)) for _, r in runs)
    if not top > 0:
        return None
    parts = list(_stretches(runs, top))
    if len(parts) < 2:
        return None
    highest = HIGHEST / top
    longest = max(float(p.turns[-1] - p.turns[0]) for p in parts)
    cell = 1.0 / (CELLS * highest)
    length = next_fast_len(OVERSAMPLING * (int(longest / cell) + 2), real=True)
    step = 1.0 / (length * cell)
    keep = slice(int(np.ceil(LOWEST / top / step)), int(highest / step))
    group = np.minimum((SPEEDS * np.array([p.speed for p in parts]) / top).astype(int), SPEEDS)
    by_group = np.zeros((SPEEDS + 1, keep.stop - keep.start))
    z: Floats = np.arange(keep.start, keep.stop, dtype=np.float64) * step
    colours = {i: _Colour(r) for i, r in runs}
    for p, g in zip(parts, group, strict=True):
        window = np.hanning(p.time.size + 2)[1:-1]
        power = np.abs(transform(p.turns, p.value * window, cell, length)[keep]) ** 2
        by_group[g] += colours[p.run].out_of(power, z, p.speeds)
    ratio, p_value = _peak(by_group, z, longest, alarm)
    if ratio is None:
        return None
    found = _fitted(parts, ratio, 0.5 / longest, p_value)
    return found if found.gain > LEAST_GAIN else None


def _peak(by_group: Floats, z: Floats, longest: float, alarm: float) -> tuple[float | None, float]:
    """Ratio of the highest sum of powers that no single group of speeds carries, and its family-wise p-value.

    Whole numbers are a family of their own: blades, and the bolts and bearings of a shaft, come so many to a turn.
    """
    used = by_group.any(axis=1)
    if np.count_nonzero(used) < 2:
        return None, 1.0
    kept = by_group[used]
    total = kept.sum(axis=0)
    strong, shape = _standing(total)
    at = int(np.argmax(strong))
    p = family_wise(float(gamma_sf(strong[at], shape)), float(strong[at]), float(z[-1] - z[0]) * longest)
    orders = [int(np.argmin(np.abs(z - k))) for k in range(1, ORDERS + 1) if z[0] <= k <= z[-1]]
    if orders:
        order = max(orders, key=lambda i: strong[i])
        of_order = len(orders) * float(gamma_sf(strong[order], shape))
        p, at = min((p, at), (of_order, order))
    without = total - kept[int(np.argmax(kept[:, at])), :]
    rest, rest_shape = _standing(without)
    around = slice(max(at - 2, 0), at + 3)
    p_rest = float(gamma_sf(np.max(rest[around]), rest_shape)) * 5
    p = max(2 * p, p_rest)
    return (float(z[at]), p) if p < alarm else (None, 1.0)


def _standing(total: Floats) -> tuple[Floats, float]:
    """The sum of powers as a gamma variate of scale 1 and the shape returned: mean and spread as the bulk has them."""
    block = max(total.size // 16, 8)
    count = max(total.size // block, 1)
    size = total.size // count
    blocks = total[: count * size].reshape(count, size)
    middle = (np.arange(count) + 0.5) * size
    low, centre, high = np.quantile(blocks, (0.1587, 0.5, 0.8413), axis=1)
    shape = float(np.median((centre / np.maximum(0.5 * (high - low), 1e-300)) ** 2))
    shape = float(np.clip(shape, 1.0, 1e6))
    level_now = np.interp(np.arange(total.size), middle, np.maximum(centre, 1e-300))
    expected = gamma_median(shape)
    out: Floats = total / level_now * expected
    return out, shape


def _sums(parts: Sequence[_Stretch], z: float) -> NDArray[np.complex128]:
    return np.array([p.value @ np.exp(-2j * np.pi * z * p.turns) for p in parts])


def _fitted(parts: Sequence[_Stretch], ratio: float, reach: float, p_value: float) -> Locked:
    """Ratio by least squares, with one phase for all stretches if that keeps the power, else with one each."""
    n = np.array([p.time.size for p in parts], dtype=np.float64)
    fine = ratio + np.linspace(-1, 1, 41) * reach
    powers = [float(np.sum(np.abs(_sums(parts, z)) ** 2 / n)) for z in fine]
    best = float(fine[int(np.argmax(powers))])
    centre = np.array([p.turns.mean() for p in parts])
    spread = float(np.sqrt(np.sum(n * [np.var(p.turns) for p in parts]) / n.sum()))
    together, power = _together(parts, best, reach, centre, n)
    noise = _noise(parts, best)
    # an angle that slips across steps takes amplitude from a wave of one phase
    lost = max(max(powers) - power, 0.0) * 2 / noise
    coherent = chi2_sf(lost, 2 * len(parts) - 2) > COHERENT
    z = together if coherent else best
    sums = _sums(parts, z)
    size_std = std = float(np.sqrt(2 * noise / n.sum()))
    if coherent:
        whole = 2 * sums.sum() / n.sum()
        each = np.full(len(parts), whole)
        amplitude = float(abs(whole))
        spread = float(np.sqrt(spread**2 + np.cov(centre, aweights=n, ddof=0)))
    else:
        each = 2 * sums / n
        bias = 2 * std**2 * len(parts)
        amplitude = float(np.sqrt(max(np.sum(n * np.abs(each) ** 2) / n.sum() - bias, 0.0)))
        size_std = float(np.sqrt(std**2 + 0.5 * std**2 * bias / max(amplitude, std) ** 2))
    size = max(amplitude, std)
    ratio_std = std / (2 * np.pi * size * spread)
    phase_std = float(np.hypot(std / size, 2 * np.pi * ratio_std * float(np.average(centre, weights=n))))
    return Locked(
        ratio=z,
        ratio_std=ratio_std,
        amplitude=amplitude,
        amplitude_std=size_std,
        phase=float(np.angle(each[0] * 1j)) if coherent else None,
        phase_std=phase_std if coherent else None,
        p_value=p_value,
        gain=float((np.abs(sums.sum()) ** 2 / n.sum() if coherent else np.sum(np.abs(sums) ** 2 / n)) * 2 / noise)
        - (0.0 if coherent else 2.0 * len(parts)),
        speed=float(np.average([p.speed for p in parts], weights=n)),
        parts=_pieces(parts, each),
    )


def _pieces(
    parts: Sequence[_Stretch], each: NDArray[np.complex128]
) -> tuple[tuple[int, float, float, float, float], ...]:
    """Coefficients of cos and sin: Re(c exp(i phi)) = a cos - Im c sin."""
    return tuple(
        (p.run, float(p.time[0]), float(np.nextafter(p.time[-1], np.inf)), float(c.real), float(-c.imag))
        for p, c in zip(parts, each, strict=True)
    )


def _together(parts: Sequence[_Stretch], z: float, reach: float, centre: Floats, n: Floats) -> tuple[float, float]:
    """Ratio near `z` at which all stretches have one phase, and the power of that."""
    span = float(np.ptp(centre)) or 1.0
    offsets = np.linspace(-reach, reach, int(np.clip(8 * reach * span, 9, 20001)) | 1)
    sums = _sums(parts, z)
    best = z
    for width, offs in ((reach, offsets), (2 * reach / offsets.size, None)):
        tried = offs if offs is not None else np.linspace(-width, width, 41)
        totals = np.array([abs(np.sum(sums * np.exp(-2j * np.pi * d * centre))) for d in tried])
        best = best + float(tried[int(np.argmax(totals))])
        sums = _sums(parts, best)
    return best, float(abs(sums.sum()) ** 2 / n.sum())


def _noise(parts: Sequence[_Stretch], z: float) -> float:
    """Variance of white noise as loud as what lies beside the line: mean power of BESIDE/own turns off it."""
    powers, n = 0.0, 0.0
    for p in parts:
        own = float(p.turns[-1] - p.turns[0])
        beside = [abs(p.value @ np.exp(-2j * np.pi * (z + j / own) * p.turns)) ** 2 for j in BESIDE]
        powers += float(np.mean(beside))
        n += p.time.size
    return powers / n or 1e-300
