"""The covariance of a fit where slopes do not say it: at a parameter where the prediction jumps, and at clocks that
ended where they can.

An instant and a threshold between two levels stand on a stair, whose slope means nothing: a threshold was told to
1e-15 V that could lie anywhere between two levels. Chi-square itself says how far it could. And a clock that ended at
its bound may be anywhere within: taken for known there, a lag on a sine, which is hardly told from a delay, had a
seventh of the error that it had.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.confidence_intervals import intervals
from identification.mismatch.estimate.fitting import Fit, bounds_of, columns_of
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.value import QUANTILE
from identification.physics.term import Scale, Term
from identification.recording import Floats


def has_stairs(term: Term, scale: Scale) -> bool:
    return any(p.jumps for p in term.parameters(scale))


def covariance(fitted: Fit, data: Data, weights: Weights) -> Floats:
    """(q, q) of the whole vector, 0 where not free; a parameter of a stair by its own interval, alone."""
    out = _with_clocks(fitted, data, weights)
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


def _with_clocks(fitted: Fit, data: Data, weights: Weights) -> Floats:
    """(q, q), 0 where not free: by the slopes, clocks that ended at a bound anywhere within theirs."""
    low, high, _ = bounds_of(fitted.model, data, fitted.theta)
    ended = np.zeros(fitted.free.size, dtype=bool)
    ended[fitted.layout.shift] = True
    ended[fitted.layout.rate_shift] = bool(weights.rate)
    ended &= ~fitted.free & (high > low)
    if not ended.any():
        return np.nan_to_num(fitted.cov)
    order = np.argsort(np.concatenate([np.flatnonzero(fitted.free), np.flatnonzero(ended)]))
    moving = fitted.free | ended
    slopes = columns_of(fitted.model, fitted.theta, data, weights, ended)
    known = np.sqrt(12.0) / (high - low)[moving]  # 1 / standard deviation of what lies evenly within
    J = np.column_stack([fitted.jacobian, slopes])[:, order]
    J = np.vstack([J, np.diag(np.where(ended[moving], known, 0.0))])
    return np.nan_to_num(replace(fitted, jacobian=J, free=moving).cov)
