"""Lines locked to the rotor: a (n / n_max)^q sin(2 pi z theta + p), theta the angle turned, q by `order_law`.

Found by `rotor_search`; fitted here by least squares with one phase for as long as the data bear it: a whole run, a
minute, or a stretch of steady turning. Each stretch counts by the noise that it has at the line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.periodic.order_law import FORCE, PICK_UP, OrderLaw, Ring, laws
from identification.mismatch.periodic.order_search import ALIAS_REACH, LASTING, OrderCandidate, aliases, candidates
from identification.mismatch.periodic.recurrence import Recurrence, of_stretches
from identification.mismatch.periodic.rotor_angle import Part, wave_of
from identification.mismatch.periodic.spectrum import Series, spacing_of
from identification.mismatch.periodic.steady_segments import SteadySegment, speed_of, stretches
from identification.mismatch.periodic.whole_orders import whole_orders
from identification.recording import Floats

TRIED = np.linspace(-1.0, 1.0, 41)
"""Ratios near a candidate, in its reach."""
ALIASES = 3
"""Ratios that look alike at one speed of which the whole fit is made."""
BESIDE = (-7, -6, -5, -4, 4, 5, 6, 7)
"""Independent ratios of a stretch beside a line."""


@dataclass(frozen=True, eq=False)
class RotorOrder:
    """A wave of so many periods per turn, fitted in all stretches at once: a (n/n_top)^q sin(2 pi z theta + p)."""

    ratio: float
    ratio_std: float
    amplitude: float
    """N, at the highest speed."""
    amplitude_std: float
    phase: float | None
    phase_std: float | None
    p_value: float
    gain: float
    speed: float
    """Mean speed of the turning rotor, turns per s."""
    parts: tuple[Part, ...]
    """One for each stretch."""
    law: OrderLaw = PICK_UP
    top: float = 0.0
    """Highest speed, turns per s."""
    law_gain: float = 0.0
    """Chi-square of waves of the size that the law gives them."""
    seen: Recurrence | None = None
    """Whether it comes again in other runs, or in other parts of the only one."""


@dataclass(frozen=True, eq=False)
class _LocalNoise:
    """Of the stretches, at one ratio."""

    own: Floats
    """(k,) variance of white noise as loud as that of the run at the line: what the waves were whitened with."""
    beside: float
    """How much louder it is beside the line."""


@dataclass(frozen=True, eq=False)
class _Waves:
    """Waves of one ratio, with a phase for each piece of the data."""

    ratio: float
    piece: NDArray[np.intp]
    """(k,) of each stretch."""
    sums: NDArray[np.complex128]
    """(pieces,) of value exp(-2 pi i ratio turns) over the variance of the noise."""
    weights: Floats
    """(pieces,) samples over that variance."""

    @property
    def gain(self) -> float:
        """Chi-square."""
        return float(2 * np.sum(np.abs(self.sums) ** 2 / self.weights))

    @property
    def of_one_size(self) -> float:
        """The same of waves whose size is one, whatever their phases."""
        return float(2 * np.sum(np.abs(self.sums)) ** 2 / np.sum(self.weights))

    @property
    def earned(self) -> float:
        """The same without what noise would give, one phase being free."""
        return self.gain - 2.0 * (self.weights.size - 1)


def find_locked(
    runs: Sequence[tuple[int, Series]], alarm: float, *, in_turns: bool = True, ring: Ring | None = None
) -> RotorOrder | None:
    """The most significant rotor-locked line; None without one.

    `in_turns`: angles are those of the propeller, whose waves come a whole number of times a turn. `ring`:
    of the stand.
    """
    top = max(float(np.quantile(speed_of(r), 0.99)) for _, r in runs)
    if not top > 0:
        return None
    parts = list(stretches(runs, top))
    if len(parts) < 2:
        return None
    every = [each for law in (FORCE, PICK_UP) for each in candidates(law.on(parts, 0.0, top), top)]
    ways = 2  # of two laws
    if in_turns and not all(r.converter.instant for _, r in runs):
        every += [each for law in (FORCE, PICK_UP) for each in whole_orders(partial(law.on, parts, top=top), top)]
        ways *= 2
    every = [replace(each, p_value=min(ways * each.p_value, 1.0)) for each in every]
    likely = [each for each in every if _passes(each, alarm, in_turns)]
    if not likely:
        return None
    # a law that has nearly all at one speed: orders of other ratios look alike by their powers, not by their waves
    tried = [(_of_best_law(parts, each, top, ring), each) for each in likely]
    found, candidate = max(tried, key=lambda each: each[0].law_gain)
    alike: list[OrderCandidate] = []
    if found.law.growth and not in_turns:  # nearly all at one speed, and no whole number of times a turn to go by
        rate = 1.0 / min(spacing_of(r.time)[0] for _, r in runs)
        alike = aliases(parts, replace(candidate, ratio=found.ratio), rate, top)
    for each in _likeliest(parts, alike, found.law, top):
        other = _of_best_law(parts, each, top, ring)
        if other.law_gain > found.law_gain + policy.periodic.LINE_KINDS_CHI2:
            found, candidate = other, replace(each, reach=candidate.reach)
    if not found.gain > policy.periodic.LOCKED_LINE_GAIN:
        return None
    # a loud line was part of its own noise
    loud = [wave_of(found.parts, i, r.time, 2 * np.pi * found.ratio * r.turns) for i, r in runs if r.turns is not None]
    told = _of_best_law(list(stretches(runs, top, loud)), candidate, top, ring)
    return told if told.gain > 0 else None


def _likeliest(
    parts: Sequence[SteadySegment], every: Sequence[OrderCandidate], law: OrderLaw, top: float
) -> list[OrderCandidate]:
    """Those of most power, a phase for each stretch, at the ratio within reach where they have it."""
    tried = []
    for each in every:
        waves = _apart(law.on(parts, each.ratio, top), _noise_at(parts, each.ratio), each)
        tried.append((waves.gain, replace(each, ratio=waves.ratio, reach=each.reach / ALIAS_REACH)))
    return [each for _, each in sorted(tried, key=lambda one: -one[0])[:ALIASES]]


def _passes(candidate: OrderCandidate, alarm: float, in_turns: bool) -> bool:
    """A ratio that is no whole one must be much clearer, where angles are the propeller's; a wave of several turns is
    none of the rotor."""
    if in_turns and candidate.ratio < policy.periodic.FEWEST_A_TURN:
        return False
    whole = not in_turns or _is_whole(candidate)
    return candidate.p_value < (alarm if whole else policy.periodic.ODD_ORDER_SHARE * alarm)


def _is_whole(candidate: OrderCandidate) -> bool:
    return abs(candidate.ratio - max(round(candidate.ratio), 1)) < max(
        candidate.reach, policy.periodic.WHOLE_ORDER_NEAR * candidate.ratio
    )


def _of_best_law(
    parts: Sequence[SteadySegment], candidate: OrderCandidate, top: float, ring: Ring | None
) -> RotorOrder:
    """With the size over the speeds that explains most; where the speeds tell nothing, as a force grows."""
    noise = _noise_at(parts, candidate.ratio)  # one for all laws: their gains are compared
    found = [(law, _fitted(law.on(parts, candidate.ratio, top), noise, candidate)) for law in laws(ring)]
    behind = policy.periodic.ORDER_LAW_CHI2
    law, best = max(found, key=lambda each: each[1].law_gain - (0.0 if each[0] == FORCE else behind))
    return replace(best, law=law, top=top)


def _fitted(parts: Sequence[SteadySegment], noise: _LocalNoise, candidate: OrderCandidate) -> RotorOrder:
    """With the fewest phases that keep the power."""
    finest = waves = _apart(parts, noise, candidate)
    for seconds in LASTING:
        fewer = _joined(parts, noise, finest.ratio, candidate.reach, _pieces_of(parts, seconds))
        # an angle that slips takes amplitude from waves of one phase
        lost, phases = max(finest.gain - fewer.gain, 0.0), finest.weights.size - fewer.weights.size
        if fewer.earned > policy.periodic.LOCKED_LINE_GAIN and (
            phases == 0 or chi2_sf(lost, 2 * phases) > policy.periodic.COHERENT_PHASE_P
        ):
            waves = fewer
            break
    span = [(p.run, float(p.time[0]), float(p.time[-1])) for p in parts]
    each = np.arange(len(parts))
    seen = of_stretches(span, waves.piece, _sums(parts, noise, waves.ratio), _weights(parts, noise, each))
    return replace(_told(parts, waves, candidate.p_value), seen=seen)


def _noise_at(parts: Sequence[SteadySegment], ratio: float) -> _LocalNoise:
    return _LocalNoise(np.array([p.colour.variance(ratio, p.speeds) for p in parts]), _beside(parts, ratio))


def _beside(parts: Sequence[SteadySegment], ratio: float) -> float:
    """How much louder than its noise the residual is on either side of a line: of repeated shapes there are many."""
    powers = n = 0.0
    for p in parts:
        own = float(np.ptp(p.turns))
        powers += float(np.mean([abs(p.wave(ratio + j / own)) ** 2 for j in BESIDE]))
        n += p.information
    return max(powers / n, 1.0)


def _pieces_of(parts: Sequence[SteadySegment], seconds: float) -> NDArray[np.intp]:
    """(k,) piece of so many seconds in which each stretch lies."""
    keys = [(p.run, int(p.time[0] // seconds)) for p in parts]
    known = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    return np.array([known[key] for key in keys], dtype=np.intp)


def _sums(parts: Sequence[SteadySegment], noise: _LocalNoise, ratio: float) -> NDArray[np.complex128]:
    """(k,) of value exp(-2 pi i ratio turns) over the variance of the noise."""
    waves = np.array([p.wave(ratio) for p in parts], dtype=np.complex128)
    out: NDArray[np.complex128] = waves / (np.sqrt(noise.own) * noise.beside)
    return out


def _weights(parts: Sequence[SteadySegment], noise: _LocalNoise, piece: NDArray[np.intp]) -> Floats:
    n = np.array([p.information for p in parts]) / (noise.own * noise.beside)
    return np.asarray(np.bincount(piece, n), dtype=np.float64)


def _added(sums: NDArray[np.complex128], piece: NDArray[np.intp]) -> NDArray[np.complex128]:
    """Sums over the stretches of each piece."""
    out = np.zeros(int(piece.max()) + 1, dtype=np.complex128)
    np.add.at(out, piece, sums)
    return out


def _apart(parts: Sequence[SteadySegment], noise: _LocalNoise, candidate: OrderCandidate) -> _Waves:
    """A phase for each stretch; the ratio of most power near the candidate's."""
    piece = np.arange(len(parts))
    weights = _weights(parts, noise, piece)
    tried = [
        _Waves(z, piece, _sums(parts, noise, z), weights) for z in (candidate.ratio + TRIED * candidate.reach).tolist()
    ]
    return max(tried, key=lambda waves: waves.gain)


def _joined(
    parts: Sequence[SteadySegment], noise: _LocalNoise, ratio: float, reach: float, piece: NDArray[np.intp]
) -> _Waves:
    """A phase for each piece; the ratio within `reach` of the one given at which that has most power."""
    weights = _weights(parts, noise, piece)
    centre = np.array([p.turns.mean() for p in parts])
    span = float(np.ptp(centre)) or 1.0
    for _ in range(2):
        sums = _sums(parts, noise, ratio)
        offsets = np.linspace(-reach, reach, int(np.clip(8 * reach * span, 40, 20000)) | 1)
        gains = [
            float(np.sum(np.abs(_added(sums * np.exp(-2j * np.pi * d * centre), piece)) ** 2 / weights))
            for d in offsets
        ]
        ratio += float(offsets[int(np.argmax(gains))])
        reach = 2 * reach / offsets.size
    return _Waves(ratio, piece, _added(_sums(parts, noise, ratio), piece), weights)


def _told(parts: Sequence[SteadySegment], waves: _Waves, p_value: float) -> RotorOrder:
    """Amplitude, ratio and phase with what is not known of them."""
    each, total = 2 * waves.sums / waves.weights, float(waves.weights.sum())
    coherent = each.size == 1
    std = size_std = float(np.sqrt(2 / total))
    amplitude = float(np.sqrt(np.sum(waves.weights * np.abs(each) ** 2) / total))
    if not coherent:
        bias = 2 * std**2 * each.size
        amplitude = float(np.sqrt(max(amplitude**2 - bias, 0.0)))
        size_std = float(np.sqrt(std**2 + 0.5 * std**2 * bias / max(amplitude, std) ** 2))
    size = max(amplitude, std)
    n = np.array([p.information for p in parts], dtype=np.float64)
    ratio_std = std / (2 * np.pi * size * _spread(parts, n, waves.piece))
    mean_turns = float(np.average([p.turns.mean() for p in parts], weights=n))
    return RotorOrder(
        ratio=waves.ratio,
        ratio_std=ratio_std,
        amplitude=amplitude,
        amplitude_std=size_std,
        phase=float(np.angle(each[0] * 1j)) if coherent else None,
        phase_std=float(np.hypot(std / size, 2 * np.pi * ratio_std * mean_turns)) if coherent else None,
        p_value=p_value,
        gain=waves.gain if coherent else waves.gain - 2.0 * each.size,
        speed=float(np.average([p.speed for p in parts], weights=n)),
        parts=tuple(
            Part(
                *(p.run, float(p.time[0]), float(np.nextafter(p.time[-1], np.inf)), float(c.real), float(-c.imag)),
                weight=(p.time, p.weight),
            )
            for p, c in zip(parts, each[waves.piece], strict=True)
        ),
        law_gain=waves.of_one_size - 2.0 * (waves.weights.size - 1),
    )


def _spread(parts: Sequence[SteadySegment], n: Floats, piece: NDArray[np.intp]) -> float:
    """Standard deviation of the angle within the pieces, turns."""
    centre = np.array([p.turns.mean() for p in parts])
    middle = np.bincount(piece, n * centre) / np.bincount(piece, n)
    within = np.array([np.var(p.turns) for p in parts]) + (centre - middle[piece]) ** 2
    return float(np.sqrt(np.average(within, weights=n)))
