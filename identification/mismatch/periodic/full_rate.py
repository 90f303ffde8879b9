"""The residual at the recording's own samples, with the angle of the rotor beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.each_sample import foretold
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.sub_interval import delay_of
from identification.mismatch.periodic.periodic_disturbances import Line
from identification.mismatch.periodic.rotor_angle import turned
from identification.mismatch.periodic.spectrum import Series
from identification.run_history.history import History

STEADY = 10.0
"""s of the blocks over which a measured rate is compared with the model's."""


def series_of(fitted: Fit, data: Data) -> tuple[Series, ...]:
    """Measured minus predicted at every sample that the intervals hold; turns from the rate, or from the model, of when
    the force was: 3 ms are half a period of five waves a turn at 34 turns/s."""
    out = []
    follows = _rate_follows(fitted, data)
    late = delay_of(fitted.model, fitted.theta) + fitted.theta.shift - (0.0 if follows else fitted.theta.rate_shift)
    for run, tare in zip(data.runs, fitted.theta.tares, strict=True):
        h = run.history
        _, x = predict(fitted.model, fitted.theta, run, data.scale, tare)
        at = foretold(fitted.model, fitted.theta, run, data.scale, tare)
        residual = h.sample_thrust - at - tare
        speed = fitted.theta.k * x if follows else h.others.get("rotation_rate", x)
        out.append(Series(h.sample_time, residual, turned(h.edges, speed, h.sample_time - late), h.converter))
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
    return bool(
        found.size >= policy.periodic.RATE_BLOCKS
        and found.mean() < 1.0 + policy.periodic.RATE_WANDERS_SIGMA * np.sqrt(2.0 / found.size)
    )


def _blocks(history: History) -> NDArray[np.intp]:
    """(m,) block of STEADY s that each measured rate is in."""
    return (history.middle[history.rate_rows] / STEADY).astype(np.intp)


def scale_std_of(fitted: Fit, data: Data) -> float:
    """Relative standard error of the scale of turns: noise of the rate is in the angle, summed or fitted."""
    _, modelled = raw(fitted.model, fitted.theta, data, with_rate=True)
    noise = size = 0.0
    for h, model in zip(data.histories, modelled, strict=True):
        width = h.dt[h.rate_rows]
        noise += float(np.sum(np.bincount(_blocks(h), (h.rates - model) * model * width) ** 2))
        size += float(np.sum(model**2 * width))
    return float(np.sqrt(noise)) / size if size > 0 else 0.0


def with_scale(line: Line, scale_std: float, series: Sequence[Series]) -> Line:
    """A line locked to the rotor, with the error that the scale of its turns adds to periods per turn and phase."""
    if line.rival is not None:
        line = replace(line, rival=with_scale(line.rival, scale_std, series))
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
