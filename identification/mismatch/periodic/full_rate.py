"""The residual at the recording's own samples: lines in it are taken out, broad peaks are told to the noise model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.model import Data, predict
from identification.mismatch.model.sub_interval import sample_lead
from identification.mismatch.periodic.periodic_disturbances import Line, find_lines
from identification.mismatch.periodic.resonances import find_bands
from identification.mismatch.periodic.rotor_angle import turned
from identification.mismatch.periodic.spectrum import Series
from identification.recording import Floats
from identification.run_history.filters import delayed, within_intervals
from identification.run_history.history import History

UNSETTLED = 0.4
"""s after a step in which a residual is no noise."""
MOST_BANDS = 1
FEW_SAMPLES = 400
STEADY = 10.0
"""s of the blocks over which a measured rate is compared with the model's."""
FEW_BLOCKS = 10
"""Fewer tell nothing of a rate."""
MUCH = 4.0
"""Standard deviations of a mean over the blocks beyond which a rate wanders."""


@dataclass(frozen=True, eq=False)
class Cleaned:
    """What was found at full rate."""

    lines: tuple[Line, ...]
    bands: tuple[tuple[float, float], ...]
    histories: tuple[History, ...]
    """Without the lines."""


def series_of(fitted: Fit, data: Data) -> tuple[Series, ...]:
    """Measured minus predicted at every sample that the intervals hold; turns from the rate, or from the model."""
    out = []
    follows = _rate_follows(fitted, data)
    for i, h in enumerate(data.histories):
        F, x = predict(fitted.model, fitted.theta, h, data.scale, i)
        if fitted.theta.shift:
            F = delayed(F, h.edges, fitted.theta.shift)
        at = within_intervals(F, h.edges, h.sample_time)
        rate = within_intervals(x, h.edges, h.sample_time)
        at += fitted.theta.C * sample_lead(fitted.model, fitted.theta, h, rate, data.scale.driver)
        residual = h.sample_thrust - at - fitted.theta.tares[i]
        speed = fitted.theta.k * x if follows else h.others.get("rotation_rate", x)
        out.append(Series(h.sample_time, residual, turned(h.edges, speed, h.sample_time)))
    return tuple(out)


def _rate_follows(fitted: Fit, data: Data) -> bool:
    """Whether the measured rate is the model's but for white noise: summed up, that would only blur the angle.

    What is left is summed over blocks; the squares of its parts say how large that is when they are independent.
    """
    if not data.with_rate:
        return False
    _, modelled = raw(fitted.model, fitted.theta, data, with_rate=True)
    blocks = []
    for h, model in zip(data.histories, modelled, strict=True):
        turned_more = (h.rates - model) * np.sign(model) * h.dt[h.rate_rows]
        block = _blocks(h)
        size = np.bincount(block, turned_more**2)
        blocks.append(np.bincount(block, turned_more)[size > 0] ** 2 / size[size > 0])
    found = np.concatenate(blocks)
    return bool(found.size >= FEW_BLOCKS and found.mean() < 1.0 + MUCH * np.sqrt(2.0 / found.size))


def _blocks(history: History) -> NDArray[np.intp]:
    """(m,) block of STEADY s that each measured rate is in."""
    return (history.middle[history.rate_rows] / STEADY).astype(np.intp)


def _scale_std(fitted: Fit, data: Data) -> float:
    """Relative standard error of the scale of turns: noise of the rate is in the angle, summed or fitted."""
    _, modelled = raw(fitted.model, fitted.theta, data, with_rate=True)
    noise = size = 0.0
    for h, model in zip(data.histories, modelled, strict=True):
        width = h.dt[h.rate_rows]
        noise += float(np.sum(np.bincount(_blocks(h), (h.rates - model) * model * width) ** 2))
        size += float(np.sum(model**2 * width))
    return float(np.sqrt(noise)) / size if size > 0 else 0.0


def _with_scale(line: Line, scale_std: float, series: Sequence[Series]) -> Line:
    """A line locked to the rotor, with the error that the scale of its turns adds to periods per turn and phase."""
    if line.rival is not None:
        line = replace(line, rival=_with_scale(line.rival, scale_std, series))
    if line.ratio is None or line.ratio_std is None:
        return line
    ratio_std = float(np.hypot(line.ratio_std, line.ratio * scale_std))
    if line.phase_std is None:
        return replace(line, ratio_std=ratio_std)
    turns = float(np.mean(np.concatenate([s.turns for s in series])))
    return replace(
        line,
        ratio_std=ratio_std,
        phase_std=float(np.hypot(line.phase_std, 2 * np.pi * line.ratio * scale_std * turns)),
    )


def look(fitted: Fit, data: Data, originals: Sequence[History]) -> Cleaned | None:
    """Lines and bands of what this fit leaves; None when there are neither."""
    series = series_of(fitted, data)
    if all(s.time.size < FEW_SAMPLES for s in series):
        return None
    has_rate = all("rotation_rate" in (h.driver_quantity, *h.others) for h in data.histories)
    unit: Literal["rev", "V s"] = "rev" if has_rate else "V s"
    lines = find_lines(series, turns_unit=unit)
    if lines and data.with_rate:
        scale_std = _scale_std(fitted, data)
        lines = tuple(_with_scale(line, scale_std, series) for line in lines)
    still = []
    for i, (s, h) in enumerate(zip(series, data.histories, strict=True)):
        left = s.residual.copy()
        for line in lines:
            left -= line.at(s.time, s.turns, i)
        left[h.since_step[_interval(h, s.time)] < UNSETTLED] = np.nan
        still.append(replace(s, residual=left))
    bands = find_bands(still, most=MOST_BANDS)
    if not lines and not bands:
        return None
    cleaned = tuple(
        _without(h, [line.at(s.time, s.turns, i) for line in lines])
        for i, (h, s) in enumerate(zip(originals, series, strict=True))
    )
    return Cleaned(lines, bands, cleaned)


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
