"""The stage: a first model and the runs in, the runs without their lines out, and where the noise has a broad peak.

It looks at what the first model leaves at every sample; the means over intervals would have averaged a line away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import acting
from identification.mismatch.noise.rounding_error import rounding_wave
from identification.mismatch.periodic.full_rate import scale_std_of, series_of, with_scale
from identification.mismatch.periodic.periodic_disturbances import Band, Line, find_lines
from identification.mismatch.periodic.plan_rhythm import of_the_plan, within
from identification.mismatch.periodic.resonances import find_bands
from identification.mismatch.periodic.spectrum import Series
from identification.recording import Floats
from identification.run_history.history import History


@dataclass(frozen=True, eq=False, slots=True)
class Cleaned:
    """What was found at full rate."""

    lines: tuple[Line, ...]
    """Periodic disturbances, the clearest first."""
    bands: tuple[tuple[float, float], ...]
    """(Hz, quality) of broad peaks of the noise."""
    histories: tuple[History, ...]
    """The runs without the lines."""

    @property
    def changed(self) -> bool:
        """Whether the model has to be selected again, on these runs and with this noise."""
        return bool(self.lines or self.bands)


def untouched(histories: Sequence[History]) -> Cleaned:
    """The runs as they are, where nobody looked."""
    return Cleaned((), (), tuple(histories))


def run(fitted: Fit, data: Data, originals: Sequence[History]) -> Cleaned:
    """Lines and bands of what this fit leaves; `originals`: the runs from which lines are taken."""
    series = series_of(fitted, data)
    if all(s.time.size < policy.periodic.FULL_RATE_SAMPLES for s in series):
        return untouched(originals)
    lines = _lines(fitted, data, series)
    bands = find_bands(_still(series, lines, data))
    histories = tuple(
        _without(h, [line.at(s.time, s.turns, i) for line in lines])
        for i, (h, s) in enumerate(zip(originals, series, strict=True))
    )
    return Cleaned(lines, bands, histories)


def _lines(fitted: Fit, data: Data, series: Sequence[Series]) -> tuple[Line, ...]:
    has_rate = all("rotation_rate" in (h.driver_quantity, *h.others) for h in data.histories)
    unit: Literal["rev", "V s"] = "rev" if has_rate else "V s"
    least = max(_of_rounding(s, h) for s, h in zip(series, data.histories, strict=True))
    found = find_lines(series, turns_unit=unit, ring=_ring(fitted, data))
    plan = [band for h in data.histories for band in of_the_plan(h)]
    skipped = _peaks(found)
    if sum(line.kind == "fixed" and within(line.frequency, plan) for line in found) > 1:  # one may be there by chance
        skipped += plan
    if skipped:
        found = find_lines(series, turns_unit=unit, ring=_ring(fitted, data), skipped=skipped)
    shown = [line for line in found if line.shown_amplitude > least]
    lines = tuple(line for line in shown if _stands_where_settled(line, found, series, data))
    if not lines or not data.with_rate:
        return lines
    scale_std = scale_std_of(fitted, data)
    return tuple(with_scale(line, scale_std, series) for line in lines)


def _peaks(lines: Sequence[Line]) -> list[Band]:
    """Hz, round lines of one frequency that stand too near to one another to be any."""
    fixed = sorted((line for line in lines if line.kind == "fixed"), key=lambda line: line.frequency)
    reach = policy.periodic.APART
    return [
        (low.frequency - reach * _resolution(low), high.frequency + reach * _resolution(high))
        for low, high in pairwise(fixed)
        if high.frequency - low.frequency < reach * _resolution(low)
    ]


def _stands_where_settled(line: Line, found: Sequence[Line], series: Sequence[Series], data: Data) -> bool:
    """Whether it takes from what is left about as much where the rotor has settled as everywhere; also where nothing
    settles. What a model lacks of dynamics comes again after each step, and looks like a wave that does."""
    gain, wave = np.zeros((2, 2))  # everywhere and where it has settled, N^2
    for i, (s, h) in enumerate(zip(series, data.histories, strict=True)):
        waves = [each.at(s.time, s.turns, i) for each in found]
        own, left = line.at(s.time, s.turns, i), s.residual - np.sum(waves, axis=0)
        less = np.nan_to_num((left + own) ** 2 - left**2)
        for k, counts in enumerate((np.ones(own.size), _settled(h, s.time).astype(np.float64))):
            gain[k] += float(less @ counts)
            wave[k] += float(own**2 @ counts)
    share = wave[1] / wave[0]
    asked = share >= policy.periodic.SETTLED_LEAST
    return not asked or bool(gain[1] >= policy.periodic.SETTLED_GAIN * share * gain[0])


def _resolution(line: Line) -> float:
    """Hz, 1/T of the longest run."""
    return line.band[1] - line.frequency


def _of_rounding(series: Series, history: History) -> float:
    """N: a wave no larger may be made by the steps of the reading, over which the thrust passes as the plan has it."""
    left = series.residual[np.isfinite(series.residual)]
    return rounding_wave(float(np.var(left)), history.quantum) if left.size else 0.0


def _ring(fitted: Fit, data: Data) -> tuple[float, float, float] | None:
    """Of the stand, where the model has it ring."""
    for term, values, sizes in acting(fitted.model, fitted.theta, data.scale):
        known = None if term.traits.dynamics is None else term.traits.dynamics(term, values, sizes.driver)
        if known is not None and known.ring is not None:
            return known.ring
    return None


def _still(series: Sequence[Series], lines: Sequence[Line], data: Data) -> list[Series]:
    """The residuals without the lines, NaN shortly after steps, where they are no noise."""
    out = []
    for i, (s, h) in enumerate(zip(series, data.histories, strict=True)):
        left = s.residual.copy()
        for line in lines:
            left -= line.at(s.time, s.turns, i)
        left[~_settled(h, s.time)] = np.nan
        out.append(replace(s, residual=left))
    return out


def _settled(history: History, time: Floats) -> NDArray[np.bool_]:
    """(n,) whether a step is long past."""
    return np.asarray(history.since_step[_interval(history, time)] >= policy.periodic.UNSETTLED)


def _interval(history: History, time: Floats) -> NDArray[np.intp]:
    index = np.searchsorted(history.edges, time, side="right") - 1
    return np.clip(index, 0, history.driver.size - 1)


def _without(history: History, lines: Sequence[Floats]) -> History:
    """The history of the same samples less the lines."""
    if not lines:
        return history
    value = history.sample_thrust - np.sum(lines, axis=0)
    index = _interval(history, history.sample_time)
    M = history.driver.size
    some = np.maximum(history.count, 1)
    mean = np.where(history.count > 0, np.bincount(index, weights=value, minlength=M) / some, np.nan)
    within = np.asarray(np.bincount(index, weights=(value - mean[index]) ** 2, minlength=M), dtype=np.float64)
    return replace(history, thrust=mean, within=within, sample_thrust=value)
