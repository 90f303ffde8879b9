"""Noise after steps, of which no stationary law knows: water that has not settled yet is unquiet.

What is left after every step looks like structure to a test against stationary noise. It is noise where its sign is
any from step to step: then a variance that goes with the thrust that has not settled describes it, beside columns of
any shape over every covariate, which take what is alike in all steps.
Where nothing is left, the values are told by that law as well: one of the same size everywhere has the noise right
after a step too small, and would take C from the jump there with a standard error several times too small.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.locate.slow_change import span_of
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.covariates import covariates
from identification.recording import Floats
from identification.run_history.filters import lowpass

DECAYS = (0.08, 0.2, 0.5, 1.25, 3.1)
"""s, in which water may settle: from a rotor's own time to that of a tank's turn-over near it."""
DECAY_STEPS = (2.5, 1.6, 1.25)
"""Ratios by which the likeliest is sought from there."""
TRIED_SHARES = np.concatenate([[0.0], np.geomspace(1e-4, 0.3, 24)])
"""Standard deviation over the thrust that has not settled."""
TIME_CONSTANTS = (0.1, 0.5)
"""Time constants of the noise in units of that decay: quick eddies, and ones that live half as long as the unrest."""
LEAST_SLOW_SHARE = 1e-5
"""Of a sample's white variance: a slow part with less is none."""


def beside_unrest(estimate: Estimate, data: Data) -> Estimate | None:
    """The same model with the noise after steps estimated beside any shape; None where it describes no more."""
    if any(h.static for h in data.histories):
        return None
    shapes = np.column_stack([np.concatenate(c.columns) for c in covariates(estimate.fit, data)])
    span, residual = span_of(shapes, estimate, data), estimate.fit.residual[: data.size]
    plain = _plainly(estimate, data, residual - span @ (span.T @ residual))
    return None if plain is None else _estimated(estimate, data, *plain, shapes)


def told_by_unrest(estimate: Estimate, data: Data) -> Estimate:
    """A model that leaves nothing but noise, fitted by the noise after steps that its residual shows; as it is where
    that describes no more.

    How long water takes to settle is sought by the likelihood of the fit: a residual whitened by a law that does not
    hold tells it to a factor of three, and the wrong decay moves C by several of its errors.
    """
    if any(h.static for h in data.histories):
        return estimate
    plain = _plainly(estimate, data, estimate.fit.residual[: data.size])
    if plain is None:
        return estimate
    at, share = plain
    best = _estimated(estimate, data, at, share)
    for way in (way for ratio in DECAY_STEPS for way in (ratio, 1 / ratio)):
        while DECAYS[0] <= at * way <= DECAYS[-1]:
            other = _estimated(estimate, data, at * way, share)
            if other.fit.deviance >= best.fit.deviance:
                break
            at, best = at * way, other
    return best


def _plainly(estimate: Estimate, data: Data, rest: Floats) -> tuple[float, float] | None:
    """(decay in s, share) that describe `rest` (n,) of a whitened residual plainly better than its stationary law."""
    found = [(*_likeliest_share(rest, estimate, _unsettled(estimate, data, decay)), decay) for decay in DECAYS]
    gain, share, decay = max(found)
    return None if float(chi2_sf(gain, 2)) > policy.locate.UNREST_FALSE_ALARM else (decay, share)


def _estimated(estimate: Estimate, data: Data, decay: float, share: float, shapes: Floats | None = None) -> Estimate:
    """The same model by a law with noise after steps, estimated beside raw `shapes` (n, p)."""
    size = _unsettled(estimate, data, decay)
    rows = tuple(replace(r, unsettled=s) for r, s in zip(estimate.rows, size, strict=True))
    begin = _with_part_after_steps(estimate.noise, decay, share)
    return refresh(estimate.fit.model, estimate.fit.theta, data, shapes, replace(estimate, rows=rows), begin)


def _with_part_after_steps(noise: Noise, decay: float, share: float) -> Noise:
    """A law to begin the search for variances at: time scales that have none give way."""
    used = [(T, v) for T, v in zip(noise.scales, noise.slow, strict=True) if v > LEAST_SLOW_SHARE * noise.white]
    parts = [(decay * part, 0.5 * share**2) for part in TIME_CONSTANTS]
    scales, slow = zip(*used, *parts, strict=True)
    return replace(noise, scales=scales, slow=slow, after_steps=len(parts))


def _unsettled(estimate: Estimate, data: Data, decay: float) -> list[Floats]:
    """(n,) N at the rows of each run: by how much the thrust differs from its mean of late."""
    out = []
    for run, history, rows, tare in zip(data.runs, data.histories, data.rows, estimate.fit.theta.tares, strict=True):
        force = predict(estimate.fit.model, estimate.fit.theta, run, data.scale, tare)[0] - tare
        late = lowpass(force, history.dt, decay, float(force[0]))[1]
        out.append(np.abs(force - late)[rows])
    return out


def _likeliest_share(rest: Floats, estimate: Estimate, size: list[Floats]) -> tuple[float, float]:
    """(fall of the deviance, share) where unit innovations (n,) have the variance 1 + (share size)^2 / what it was."""
    more = np.concatenate([s**2 / w.innovation for s, w in zip(size, estimate.weights.thrust, strict=True)])
    variance = 1.0 + TRIED_SHARES[:, None] ** 2 * more
    deviance = np.sum(np.log(variance) + rest**2 / variance, axis=1)
    best = int(np.argmin(deviance))
    return float(deviance[0] - deviance[best]), float(TRIED_SHARES[best])
