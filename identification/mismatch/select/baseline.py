"""Where a search begins: C V|V| and tares, with the noise that is left when what is plainly no noise is taken out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, by_run, refresh, unweighted
from identification.mismatch.estimate.fitting import Fit, fit, raw
from identification.mismatch.model.data import Data, PriorPredictionFactor
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import Predictor
from identification.mismatch.model.whitening import Weights
from identification.mismatch.noise.rounding_error import rounding_errors
from identification.mismatch.prepare.scales import scale_of
from identification.mismatch.select.covariates import covariates
from identification.mismatch.select.family_wise import MOST_PLAIN, lengths, matching_pursuit, orthogonal_basis
from identification.mismatch.select.likeliest_trials import jumps
from identification.physics.term import Term
from identification.recording import Floats
from identification.run_history.history import History

NOISE_ROUNDS = 5
"""Rounds of taking out what is plainly no noise and estimating the noise of the rest, at most."""


def start(histories: Sequence[History]) -> tuple[Data, Theta]:
    """Ordinary least squares of C and the tares, without any weights."""
    gram, right = 0.0, 0.0
    means = []
    for h in histories:
        r = h.rows
        f = h.driver[r] * np.abs(h.driver[r])
        y = h.thrust[r]
        fm, ym = f.mean(), y.mean()
        gram += float(np.sum((f - fm) ** 2))
        right += float(np.sum((f - fm) * (y - ym)))
        means.append((fm, ym))
    C = right / gram if gram > 0 else 0.0
    with_rate = all(h.rate is not None and h.rate_rows.size > policy.select.RATE_ROWS for h in histories)
    moving = histories[0].driver_quantity == "command_voltage" and not any(h.static for h in histories)
    most = _most_shift(histories) if moving else 0.0
    predictor = Predictor()
    scale = scale_of([predictor.run(h) for h in histories], C or 1e-12)
    data = Data(tuple(histories), scale, with_rate=with_rate, most_shift=most, predictor=predictor)
    data = replace(data, prior_factor=level_error_factor(data, C))
    return data, Theta(C, (), tuple(float(ym - C * fm) for fm, ym in means), k=_k(histories))


def _most_shift(histories: Sequence[History]) -> float:
    """S by which force and driver may be apart: what a recording says that it does not know of a delay counts whole."""
    unsure = policy.select.STATED_DELAY_SIGMA * max(h.delay_std for h in histories)
    return max(min(policy.select.CLOCK_DIFFERENCE, max(h.jitter for h in histories)), unsure)


def level_error_factor(data: Data, C: float) -> PriorPredictionFactor | None:
    """What the thrust C n|n| is off by where a noisy driver stood still, and its reading where steps round it: at all
    of a level alike, so that levels scatter more than their samples say."""
    own = [_level_errors(h, C)[h.rows] for h in data.histories]
    total = sum(errors.shape[1] for errors in own)
    if not total:
        return None
    thrust, at = [], 0
    for errors in own:
        columns = np.zeros((errors.shape[0], total))
        columns[:, at : at + errors.shape[1]] = errors
        thrust.append(columns)
        at += errors.shape[1]
    return PriorPredictionFactor(tuple(thrust), tuple(np.zeros((h.rates.size, total)) for h in data.histories))


def _level_errors(h: History, C: float) -> Floats:
    """(M, k) N, of the driver and of the reading."""
    if not h.level_errors.size:
        return rounding_errors(h, C)
    return np.column_stack([2 * C * np.abs(h.driver)[:, None] * h.level_errors, rounding_errors(h, C)])


def _k(histories: Sequence[History]) -> float:
    return float(np.mean([h.rate_per_driver for h in histories]))


def every_shape(fit_now: Fit, data: Data, terms: Sequence[Term]) -> Floats:
    """(n, k) raw columns: all trials of the catalogue's terms, and any shape over each covariate. Of a rare form that
    refines another one none: it nearly has the other's shape."""
    shapes = [np.concatenate(c.columns) for c in covariates(fit_now, data)]
    asked = [t for t in terms if not (t.traits.closer and t.traits.rare)]
    columns = np.column_stack([raw_directions(fit_now, data, asked), *shapes])
    some = lengths(columns) > 0
    return columns if some.all() else columns[:, some]


def plain_shapes(fit_now: Fit, data: Data, judged: Weights, raw_columns: Floats) -> Floats:
    """(n, k) those of `every_shape` that together take what is plainly no noise.

    Orthogonal matching pursuit. Noise is estimated beside these columns, or a mismatch would be mistaken for it.
    """
    thrust_only = Weights(judged.thrust)
    n = data.size
    columns = thrust_only.whiten(by_run(raw_columns, data), [])
    basis = orthogonal_basis(fit_now.jacobian[:n])
    columns -= basis @ (basis.T @ columns)
    first = lengths(columns)
    columns *= np.where(first > 1e-6 * np.median(first), 1 / np.maximum(first, 1e-300), 0.0)
    chosen, _ = matching_pursuit(columns, fit_now.residual[:n], policy.select.PLAIN_DIRECTION_SIGMA, MOST_PLAIN)
    out: Floats = raw_columns[:, chosen]
    return out


def raw_directions(fit_now: Fit, data: Data, terms: Sequence[Term]) -> Floats:
    """(n, q) change of the thrust by each trial of each term."""
    base, _ = raw(fit_now.model, fit_now.theta, data, with_rate=False)
    columns = []
    for term in terms:
        for trial in term.trials(data.scale):
            bigger, theta = fit_now.more(term, trial)
            new, _ = raw(bigger, theta, data, with_rate=False)
            columns.append(np.concatenate(new) - np.concatenate(base))
    return np.column_stack(columns) if columns else np.empty((data.size, 0))


def plain_jumps(estimate: Estimate, data: Data) -> list[Floats]:
    """(n, 1) each: steps of the reading that are plainly no noise; slow noise would follow them."""
    if any(h.static for h in data.histories):
        return []
    when = np.concatenate([h.sampled[r] for h, r in zip(data.histories, data.rows, strict=True)])
    at, score = jumps(
        estimate.fit.residual, data, estimate.weights, orthogonal_basis(estimate.fit.jacobian[: data.size])
    )
    return [(when[:, None] >= t).astype(np.float64) for t in at[score > policy.select.PLAIN_JUMP_SIGMA][:1]]


def baseline(data: Data, theta: Theta, terms: Sequence[Term], model: Model) -> Estimate:
    """C V|V|, what is given and tares, with the noise that remains when what is plainly no noise is taken out.

    The noise is first all that is left; what stands out of even that is taken out, and so on: slow noise has many
    shapes by chance, and taken out at once they would make it look smaller than it is.
    """
    unit = unweighted(data)
    first = fit(model, theta, data, unit)
    estimate = refresh(model, first.theta, data, None, None)
    taken = 0
    shapes = every_shape(estimate.fit, data, terms)
    for _ in range(NOISE_ROUNDS):
        plain = plain_shapes(
            estimate.fit, data, estimate.weights, np.column_stack([shapes, *plain_jumps(estimate, data)])
        )
        if plain.shape[1] <= taken:
            break
        taken = plain.shape[1]
        estimate = refresh(model, estimate.fit.theta, data, plain, estimate)
    return estimate
