"""The covariance of a fit where the prediction jumps at a parameter: an instant, a threshold between two levels.

There the slope of the prediction is that of a stair, and the standard error that follows from it is of no meaning: a
threshold was told to 1e-15 V that could lie anywhere between two levels. Chi-square itself says how far it could.
"""

from __future__ import annotations

import numpy as np

from identification.mismatch.estimate.confidence_intervals import intervals
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.value import QUANTILE
from identification.physics.term import Scale, Term
from identification.recording import Floats


def has_stairs(term: Term, scale: Scale) -> bool:
    return any(p.jumps for p in term.parameters(scale))


def covariance(fitted: Fit, data: Data, weights: Weights) -> Floats:
    """(q, q) of the whole vector, 0 where not free; a parameter of a stair by its own interval, alone."""
    out = np.nan_to_num(fitted.cov)
    jumping = [term for term in fitted.model.terms if has_stairs(term, data.scale)]
    for term, known in intervals(fitted, data, weights, jumping).items():
        start = fitted.layout.of(term).start
        for j, (p, interval) in enumerate(zip(term.parameters(data.scale), known, strict=True), start):
            if p.jumps and fitted.free[j]:
                value = float(fitted.theta.vector[j])
                far = max(interval.high - value, value - interval.low)
                out[j, :] = out[:, j] = 0.0
                out[j, j] = (far / QUANTILE) ** 2
    return out
