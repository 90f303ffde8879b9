"""A fit with the noise it was judged with, and how the noise is estimated anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.estimation.singular_values import thin_svd
from identification.mismatch.estimate.between_levels import between_levels
from identification.mismatch.estimate.clock_hollows import in_best_hollow
from identification.mismatch.estimate.fitting import Fit, bounds_of, columns_of, fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights, weights
from identification.mismatch.noise.covariance import Noise, Rows
from identification.mismatch.noise.variances import fit_noise
from identification.physics.term import Term
from identification.recording import Floats
from identification.run_history.splines import spline

MOST_NODES = 17
"""Nodes of the smooth curve beside which the noise of a table is judged: as many as covariates have hats."""

HOLLOWS = 3
"""Times that a fit may be begun again in another hollow of the clocks, or with a threshold between other levels; noise
and clocks agree after one."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """A fit with the noise it was judged with."""

    fit: Fit
    noise: Noise
    rate_noise: Noise | None
    weights: Weights
    rows: tuple[Rows, ...]

    @property
    def bic(self) -> float:
        return self.fit.deviance + int(self.fit.free.sum()) * float(np.log(max(self.fit.residual.size, 2)))


def fit_without(estimate: Estimate, term: Term, data: Data, hopeless: float = np.inf) -> Fit:
    """The model without one of its terms, refitted with the same noise; once for all who ask as closely.

    Without a delay the clocks begin as far apart as it was: ticks make a hollow of each delay, and a fit that began in
    another one would stay there.

    `hopeless`: chi-square of which it is enough to know that it is more.
    """

    def made() -> Fit:
        model, theta = estimate.fit.less(term)
        if term.traits.delay:
            (delay,) = estimate.fit.values[term]
            theta = replace(theta, shift=min(max(delay, -data.most_shift), data.most_shift))
        return fit(model, theta, data, estimate.weights, hopeless=hopeless, near=estimate.fit)

    found: Fit = data.predictor.once(("without", term, hopeless), made, estimate, data)
    return found


def forces(fit_model: Model, theta: Theta, data: Data) -> list[Floats]:
    """Predicted F without tare at the rows."""
    thrust, _ = raw(fit_model, theta, data, with_rate=False)
    return [f - tare for f, tare in zip(thrust, theta.tares, strict=True)]


def refresh(
    model: Model, theta: Theta, data: Data, extra: Floats | None, estimate: Estimate | None, like: Noise | None = None
) -> Estimate:
    """Noise by REML on what the model leaves, the columns of the model (and of what was pursued) taken as fitted.

    `like`: a noise whose time scales are kept, so that likelihoods can be compared. Where the clocks stood in a wrong
    hollow, or a threshold between wrong levels, what was left was not noise, and it is estimated anew.
    """
    for _ in range(HOLLOWS):
        estimate = refreshed_once(model, theta, data, extra, estimate, like)
        deeper = between_levels(in_best_hollow(estimate.fit, data, estimate.weights), data, estimate.weights)
        if deeper is estimate.fit:
            return estimate
        theta = deeper.theta
    return refreshed_once(model, theta, data, extra, estimate, like)


def by_itself(estimate: Estimate, data: Data) -> Estimate:
    """The same model with its noise estimated from nothing, beside nothing else; once for all who ask."""
    model, theta = estimate.fit.model, estimate.fit.theta
    found: Estimate = data.predictor.once("by itself", lambda: refresh(model, theta, data, None, None), estimate)
    return found


def refreshed_once(
    model: Model, theta: Theta, data: Data, extra: Floats | None, estimate: Estimate | None, like: Noise | None
) -> Estimate:
    """The noise of what this leaves, and the fit with it, which begins where the clocks and thresholds stand."""
    size = forces(model, theta, data)
    thrust, rate = raw(model, theta, data, with_rate=data.with_rate)
    left = [y - f for y, f in zip(data.thrust, thrust, strict=True)]
    unit = unweighted(data)
    low, high, _ = bounds_of(model, data, theta)
    layout = model.layout(theta)
    may = np.ones(layout.size, dtype=bool)
    may[[layout.rate_shift, layout.k]] = False
    may[layout.shift] = high[layout.shift] > low[layout.shift]
    J = columns_of(model, theta, data, unit, may)
    parts = by_run(J, data)
    if extra is not None and extra.shape[1]:
        parts = [np.column_stack([p, e]) for p, e in zip(parts, by_run(extra, data), strict=True)]
    if data.twin_factor is not None:  # what a given baseline is not sure of is no noise
        parts = [np.column_stack(pair) for pair in zip(parts, data.of_rows(data.twin_factor.thrust), strict=True)]
    parts = independent(parts)
    rows = estimate.rows if estimate is not None else data.thrust_rows
    in_time = not any(h.static for h in data.histories)  # rows of a table may stand in the order of their levels
    least = 0.0 if in_time else max(reading_step(h.thrust[h.rows]) for h in data.histories) ** 2 / 12
    shapes = data.predictor.shapes
    noise = fit_noise(rows, left, parts, size, data.bands, like, in_time=in_time, least=least, shapes=shapes)
    rate_noise = None
    if data.with_rate:
        left_rate = [h.rates - f for h, f in zip(data.histories, rate, strict=True)]
        rate_noise = fit_noise(
            data.rate_rows,
            left_rate,
            _beside_rate(rate, data) if in_time else curves(data),
            [np.zeros(r.size) for r in left_rate],
            start=estimate.rate_noise if estimate is not None else None,
            in_time=in_time,
            shapes=shapes,
        )
    w = weights(data, noise, size, rate_noise, rows)
    return Estimate(fit(model, theta, data, w), noise, rate_noise, w, tuple(rows))


def unweighted(data: Data) -> Weights:
    white = Noise(1.0, 0.0)
    return weights(
        data,
        white,
        [np.zeros(r.size) for r in data.rows],
        None,
        [replace(r, count=np.ones(r.time.size)) for r in data.thrust_rows],
        unit=True,
    )


def _beside_rate(rate: Sequence[Floats], data: Data) -> list[Floats]:
    """(m, k) run by run, beside which the noise of the rate is judged: a factor of the rate, and what a given baseline
    is not sure of, which is no noise."""
    factor = [f[:, None] for f in rate]
    unsure = data.twin_factor.rate if data.twin_factor is not None else ()
    if len(unsure) < len(factor):
        return factor
    return independent([np.column_stack(pair) for pair in zip(factor, unsure, strict=True)])


def curves(data: Data) -> list[Floats]:
    """Any smooth curve of the rate over the driver, run by run (m, p): a table's noise is what is left beside it."""
    driver = [h.driver[h.rate_rows] for h in data.histories]
    every = np.concatenate(driver)
    nodes = np.quantile(np.unique(every), np.linspace(0, 1, max(3, min(MOST_NODES, every.size // 4))))
    return [spline(v, nodes, np.eye(nodes.size), 1) for v in driver]


def reading_step(values: Floats) -> float:
    """The step in which a table was written: its rounding is noise too, also where it says 0.00.

    >>> reading_step(np.array([0.0, 0.1, 0.1, 0.4]))
    0.1
    """
    steps = np.diff(np.unique(values))
    return float(np.min(steps, initial=np.inf, where=steps > 0)) if steps.size else 0.0


def by_run(columns: Floats, data: Data) -> list[Floats]:
    ends = np.cumsum([r.size for r in data.rows])
    return list(np.split(columns[: ends[-1]], ends[:-1]))


def independent(parts: Sequence[Floats]) -> list[Floats]:
    """The same span, run by run (n, r), orthonormal over all runs together: what repeats another is left out."""
    stacked = np.concatenate(parts)
    size = np.linalg.norm(stacked, axis=0)
    stacked = stacked[:, size > 0] / size[size > 0]
    u, s, _ = thin_svd(stacked)
    u = u[:, s > 1e-7 * s[0]] * np.sqrt(stacked.shape[0])
    ends = np.cumsum([p.shape[0] for p in parts])
    return list(np.split(u, ends[:-1]))
