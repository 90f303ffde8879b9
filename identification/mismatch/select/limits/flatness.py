"""Where a cell or its amplifier clips, it clips noise too: readings are flatter there, as no drive makes them.

An amplifier clips all of it; a cell on its stop only the noise of the force itself, which is in proportion to it.
"""

from __future__ import annotations

from typing import cast

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.mismatch.noise.covariance import Noise
from identification.physics.term import Term
from identification.physics.traits import LimitsReading
from identification.recording import Floats


def noise_goes_on(fitted: Fit, term: Term, noise: Noise, data: Data) -> bool:
    """Whether the readings scatter as ever where a load-cell saturation of the model says that they clip."""
    if term.traits.limits != "reading":
        return False
    cell = cast(LimitsReading, term)
    values = fitted.values[term]
    left = scatter = told = samples = 0.0
    told_thrust, _ = raw(fitted.model, fitted.theta, data, with_rate=False)
    for i, (h, rows) in enumerate(zip(data.histories, data.rows, strict=True)):
        whole = _force(fitted, term, data, i)
        edges = np.concatenate([whole[:1], 0.5 * (whole[1:] + whole[:-1]), whole[-1:]])
        force, first, last = whole[rows], edges[:-1][rows], edges[1:][rows]
        moved = np.abs(np.diff(edges))
        moved[1:] = np.maximum(moved[1:], moved[:-1])  # a mean over time is also of the interval before
        variance = noise.white + noise.proportional * force**2 + sum(noise.slow) + sum(noise.band)
        still = moved[rows] < np.sqrt(variance)  # on its way a force is not foretold to a part of a tick
        for side in (1.0, -1.0):
            reached = np.minimum(side * first, side * last) + side * fitted.theta.tares[i]  # not on the way there
            slope, start = cell.slope(side * reached, values), cell.start(values, side)
            deep = still & (reached > start) & (slope < policy.select.KNEE_SLOPE)
            behind = 0.0 if cell.silent else variance - noise.proportional * force**2
            if cell.sharp:
                deep &= reached > start + policy.select.CLIPPED_DEPTH * np.sqrt(variance)
            count, beside = h.count[rows][deep].astype(np.float64), h.thrust[rows][deep] - told_thrust[i][deep]
            if count.sum() > 1:
                left += float(count @ (beside - np.average(beside, weights=count)) ** 2 + h.within[rows][deep].sum())
                scatter += float(count @ variance[deep])
                told += float(count @ np.broadcast_to(np.maximum(slope**2 * variance, behind), variance.shape)[deep])
                samples += float(count.sum())
    missing = policy.select.CLIPPED_VARIANCE_MISSING * (scatter - told)
    return (
        samples >= policy.select.CLIPPED_SAMPLES
        and missing > policy.select.CLIPPED_VARIANCE_SIGMA * told * np.sqrt(2 / samples)
        and left > told + missing
    )


def _force(fitted: Fit, term: Term, data: Data, run: int) -> Floats:
    """(M,) N, of a run without the term."""
    return predict(*fitted.less(term), data.runs[run], data.scale, fitted.theta.tares[run])[0]
