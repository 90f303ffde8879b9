"""Fit of a model to whitened rows: Levenberg-Marquardt within the physical bounds (eq. 4.8 with full Sigma)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.estimate.bounded_least_squares import CLOSE, MOST_STEPS, Minimum, least_squares, promised
from identification.mismatch.model.at_samples import at_samples
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model, extended, parameters, reduced
from identification.mismatch.model.parameters import Layout, Theta
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.step_response import ticked
from identification.mismatch.model.sub_interval import delay_of, turning
from identification.mismatch.model.whitening import Weights
from identification.physics.term import Parameter, Term
from identification.recording import Floats

EDGE = 9.0
"""Fall of chi-square that the slope of a clock promises and that no step of it gives: a tick stands between, and what
the slope does may be an effect's. Less than three sigma of it would not be found anyway."""
BEYOND_CLOCKS = 2.0
"""Times the chi-square of which a fit is hopeless: no other shift of the clocks brings one down that ends above it."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A model at its best values, on whitened rows."""

    model: Model
    theta: Theta
    residual: Floats
    """(n,) whitened."""
    jacobian: Floats
    """(n, p) whitened, all parameters that were free."""
    free: NDArray[np.bool_]
    """(q,) of the whole vector of theta: what was free, and stopped by no bound, nor by a tick."""
    log_det: float = 0.0

    @property
    def chi2(self) -> float:
        return float(self.residual @ self.residual)

    @property
    def deviance(self) -> float:
        """-2 log likelihood, up to a constant; noise included, for fits with different noise."""
        return self.chi2 + self.log_det

    @property
    def cov(self) -> Floats:
        """(q, q) of the whole vector, NaN where not free."""
        q = self.free.size
        out = np.full((q, q), np.nan)
        J = self.jacobian
        size = np.linalg.norm(J, axis=0)
        size = np.where(size > 0, size, 1.0)
        inverse = np.linalg.pinv((J / size).T @ (J / size), hermitian=True, rcond=1e-12) / np.outer(size, size)
        out[np.ix_(self.free, self.free)] = inverse
        return out

    @property
    def std(self) -> Floats:
        """(q,) standard errors, NaN where not free."""
        return np.sqrt(np.diag(self.cov))

    @property
    def layout(self) -> Layout:
        return self.model.layout(self.theta)

    @property
    def values(self) -> dict[Term, tuple[float, ...]]:
        """The values of each term."""
        return self.model.values(self.theta)

    def less(self, *terms: Term) -> tuple[Model, Theta]:
        """The rest of the model without some terms, its values as they are."""
        return reduced(self.model, self.theta, terms)

    def more(self, term: Term, values: tuple[float, ...]) -> tuple[Model, Theta]:
        """The model with one term more, which begins at `values`."""
        return extended(self.model, self.theta, term, values)


def bounds_of(model: Model, data: Data, theta: Theta) -> tuple[Floats, Floats, Floats]:
    """(low, high, step) of the whole vector."""
    scale, at = data.scale, model.layout(theta)
    known = [p for group in parameters(model, scale) for p in group]
    most = 0.0 if any(term.traits.delay for term in model.terms) else data.most_shift
    low, high, step = (np.full(at.size, value) for value in (-np.inf, np.inf, 0.0))
    low[at.of_terms], high[at.of_terms] = [p.low for p in known], [p.high for p in known]
    low[at.shift], high[at.shift] = -most, most
    low[at.rate_shift], high[at.rate_shift] = -data.most_shift, data.most_shift
    step[at.C] = 1e-4 * scale.thrust / scale.driver**2
    step[at.of_terms] = [_step(p, value) for p, value in zip(known, theta.vector[at.of_terms], strict=True)]
    step[at.tares] = 1e-3 * scale.thrust
    step[at.shift] = step[at.rate_shift] = 1e-4
    step[at.k] = 1e-4 * (abs(theta.k) or 1.0)
    return low, high, step


def _step(p: Parameter, value: float) -> float:
    """Of a difference: small beside the value, or beside its range where that is small."""
    span = p.high - p.low
    return min(1e-3 * span, 1e-3 * max(abs(value), 0.02 * span))


def raw(
    model: Model, theta: Theta, data: Data, *, with_rate: bool, near: Theta | None = None
) -> tuple[list[Floats], list[Floats]]:
    """Predictions at the rows: thrust with tare, and rate; run by run.

    Ticks of the command come with the delay of `near`, else of `theta`: a small step moves none across a sample, and
    would hide the slope.
    """
    key = (model, theta.vector.tobytes(), with_rate, None if near is None else near.vector.tobytes())
    made = partial(_raw, model, theta, data, near or theta, with_rate=with_rate)
    found: tuple[list[Floats], list[Floats]] = data.predictor.lately(key, made, data)
    return found


def _raw(model: Model, theta: Theta, data: Data, there: Theta, *, with_rate: bool) -> tuple[list[Floats], list[Floats]]:
    thrust, rate = [], []
    late = delay_of(model, there) + there.shift
    for run, rows, tare in zip(data.runs, data.rows, theta.tares, strict=True):
        seen, x = at_samples(model, theta, run, data.scale, tare, late)
        thrust.append(seen[rows] + tare)
        if with_rate:
            seen = turning(model, theta, run, x, data.scale, there.rate_shift)
            rate.append(theta.k * seen[run.history.rate_rows])
    return thrust, rate


def _rates(model: Model, theta: Theta, data: Data, there: Theta) -> list[Floats]:
    """Predicted rates at their rows, run by run, as in `raw`."""
    out = []
    for run, tare in zip(data.runs, theta.tares, strict=True):
        _, x = predict(model, theta, run, data.scale, tare)
        out.append(theta.k * turning(model, theta, run, x, data.scale, there.rate_shift)[run.history.rate_rows])
    return out


def residual_of(model: Model, theta: Theta, data: Data, weights: Weights) -> Floats:
    thrust, rate = raw(model, theta, data, with_rate=bool(weights.rate))
    left = [y - f for y, f in zip(data.thrust, thrust, strict=True)]
    left_rate = [h.rates - f for h, f in zip(data.histories, rate, strict=False)] if weights.rate else []
    told = ticks_told(model, theta, data, weights)
    return weights.whiten(left, left_rate, [rows.target - f for rows, f in zip(data.ticks, told, strict=False)])


def change_of(
    before: tuple[Model, Theta], after: tuple[Model, Theta], data: Data, weights: Weights
) -> tuple[list[Floats], list[Floats], list[Floats]]:
    """What `after` predicts less what `before` does: thrust, rate and ticks, as `Weights.whiten` takes them."""
    old = (*raw(*before, data, with_rate=bool(weights.rate)), ticks_told(*before, data, weights))
    new = (*raw(*after, data, with_rate=bool(weights.rate)), ticks_told(*after, data, weights))
    thrust, rate, ticks = ([b - a for a, b in zip(x, y, strict=True)] for x, y in zip(old, new, strict=True))
    return thrust, rate, ticks


def change_of_rates(model: Model, before: Theta, after: Theta, data: Data, weights: Weights) -> Floats:
    """(n,) whitened, where the two differ in what moves the rate alone."""
    old, new = (_rates(model, theta, data, theta) for theta in (before, after))
    still = [np.zeros(y.size) for y in data.thrust]
    ticks = [np.zeros(rows.target.size) for rows in data.ticks] if weights.ticks else []
    return weights.whiten(still, [b - a for a, b in zip(old, new, strict=True)], ticks)


def ticks_told(model: Model, theta: Theta, data: Data, weights: Weights) -> list[Floats]:
    return ticked(model, theta, data) if weights.ticks else []


def columns_of(model: Model, theta: Theta, data: Data, weights: Weights, which: NDArray[np.bool_]) -> Floats:
    """(n, p) whitened slopes of the prediction over the parameters in `which`."""
    _, high, step = bounds_of(model, data, theta)
    vector, columns = theta.vector, []
    for j in np.flatnonzero(which).tolist():
        h = float(step[j] if vector[j] + step[j] <= high[j] else -step[j])
        made = partial(_column, model, theta, data, j, h)
        columns.append(data.predictor.column((model, vector.tobytes(), j), made, data))
    if not columns:
        return np.empty((residual_of(model, theta, data, weights).size, 0))
    thrust, rate, ticks = ([np.column_stack(c) for c in zip(*each, strict=True)] for each in zip(*columns, strict=True))
    return weights.whiten(thrust, rate if weights.rate else [], ticks if weights.ticks else [])


def _column(model: Model, theta: Theta, data: Data, j: int, h: float) -> list[list[Floats]]:
    """Of thrust, rate and what ticks tell, run by run, by a difference of `h` of parameter `j`; not whitened."""
    thrust, rate = raw(model, theta, data, with_rate=data.with_rate)
    ticks = ticked(model, theta, data)
    at = model.layout(theta)
    nothing = [[np.zeros(f.size) for f in each] for each in (thrust, rate, ticks)]
    run = at.run_of(j)
    if run is not None:  # a tare moves its own run by one
        return [[np.full(f.size, float(i == run)) for i, f in enumerate(thrust)], *nothing[1:]]
    vector = theta.vector
    vector[j] += h
    moved = theta.with_vector(vector)
    if j in (at.k, at.rate_shift):  # they move the rate alone
        turned = _rates(model, moved, data, theta) if data.with_rate else []
        slopes = [(after - before) / h for after, before in zip(turned, rate, strict=True)]
        return [nothing[0], slopes, nothing[2]]
    now = (*raw(model, moved, data, with_rate=data.with_rate, near=theta), ticked(model, moved, data))
    pairs = (zip(after, before, strict=True) for after, before in zip(now, (thrust, rate, ticks), strict=True))
    return [[(after - before) / h for after, before in each] for each in pairs]


def fit(
    model: Model,
    start: Theta,
    data: Data,
    weights: Weights,
    most_steps: int = MOST_STEPS,
    hopeless: float = np.inf,
    near: Fit | None = None,
) -> Fit:
    """Least squares of the whitened residual within the bounds.

    What comes late and clocks that differ look alike, and small steps of the command at few phases of the samples leave
    valleys between: where a shift of the clocks was found beside such a term, it is also looked for without one. So it
    is where none at all is better, or none between force and rate: chi-square has an edge where a step passes from one
    sample into the next.
    Ends early once chi-square is above `hopeless` and falls too slowly to get there; so does the second look. `near`: a
    fit with the same weights, with whose slopes it begins.
    """
    found = _descended(model, start, data, weights, most_steps, hopeless, near)
    if found.chi2 > BEYOND_CLOCKS * hopeless:
        return found
    shift = max(abs(found.theta.shift), abs(found.theta.rate_shift))
    if shift == 0:
        return found
    alike = replace(found.theta, shift=0.0, rate_shift=0.0)
    doubtful = shift > policy.estimate.DOUBTFUL_CLOCK_SHIFT * data.most_shift > 0 and any(
        term.traits.delays for term in model.terms
    )
    together = replace(found.theta, rate_shift=0.0)
    begins = [alike] if doubtful else [t for t in (alike, together) if _chi2(model, t, data, weights) < found.chi2]
    for begin in begins:
        other = _descended(model, begin, data, weights, most_steps, min(hopeless, found.chi2), found)
        found = min(found, other, key=lambda each: each.chi2)
    return found


def _chi2(model: Model, theta: Theta, data: Data, weights: Weights) -> float:
    left = residual_of(model, theta, data, weights)
    return float(left @ left)


def _descended(
    model: Model, start: Theta, data: Data, weights: Weights, most_steps: int, hopeless: float, near: Fit | None
) -> Fit:
    """Levenberg-Marquardt from one start."""
    low, high, _ = bounds_of(model, data, start)
    theta = start.with_vector(np.clip(start.vector, low, high))
    at = model.layout(theta)
    may = np.ones(at.size, dtype=bool)
    may[at.k] = bool(weights.rate)
    may[at.shift] = high[at.shift] > low[at.shift]
    may[at.rate_shift] = bool(weights.rate) and high[at.rate_shift] > low[at.rate_shift]

    def descended(begin: Theta, moving: NDArray[np.bool_], slopes: Floats | None = None) -> Minimum:
        return least_squares(
            lambda part: residual_of(model, begin.with_part(moving, part), data, weights),
            lambda part: columns_of(model, begin.with_part(moving, part), data, weights, moving),
            begin.vector[moving],
            low[moving],
            high[moving],
            most_steps=most_steps,
            hopeless=hopeless,
            slopes=slopes,
        )

    found = descended(theta, may, None if near is None else _begun(near, model, theta, data, weights, may))
    best = theta.with_part(may, found.at)
    still = may.copy()
    still[[at.shift, at.rate_shift]] = False
    if (
        may[at.rate_shift]
        and not (found.given_up and float(found.residual @ found.residual) > BEYOND_CLOCKS * hopeless)
        and promised(found, low[may], high[may], still[may]) > CLOSE
    ):
        # rows at the edge of a tick stopped the rate's clock, and all others with it
        best = best.with_part(still, descended(best, still).at)
        left, slopes = residual_of(model, best, data, weights), columns_of(model, best, data, weights, may)
        found = Minimum(best.vector[may], left, slopes)
    ended = (best.vector <= low) | (best.vector >= high)
    free = may & ~ended
    if free[at.shift] and not found.given_up:
        lo, hi = low[may], high[may]
        along = promised(found, lo, hi, free[may]) - promised(found, lo, hi, (free & still)[may])
        free[at.shift] = along < EDGE
    return Fit(model, best, found.residual, found.slopes[:, free[may]], free, weights.log_det)


def _begun(near: Fit, model: Model, theta: Theta, data: Data, weights: Weights, may: NDArray[np.bool_]) -> Floats:
    """(n, p) slopes to begin with: those that `near` has of the same parameters, and of the others at `theta`."""
    at = np.cumsum(near.free) - 1
    every = model.layout(theta).shared(near.layout).items()
    known = {mine: int(at[other]) for mine, other in every if near.free[other] and may[mine]}
    rest = may.copy()
    rest[list(known)] = False
    out = np.empty((near.residual.size, may.size))
    out[:, list(known)] = near.jacobian[:, list(known.values())]
    out[:, rest] = columns_of(model, theta, data, weights, rest)
    return out[:, may]
