"""One term in the place of another: where its fit begins, and the same effects in the forms that fit best."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.fitting import Fit, bounds_of, change_of, fit, residual_of
from identification.mismatch.model.data import Data, hidden_by_steps, price
from identification.mismatch.model.model import Model, extended, usual_form
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.select.limits.clipping import contradiction
from identification.physics.term import Scale, Term
from identification.recording import Floats

Start = tuple[Model, Theta]
NEAR = 0.25
"""Of what is left without the term, beyond what is left with it: a start that leaves less is near."""
FORM_STEPS = 15
"""Steps of the fit of another form, begun close by."""


def nearer(
    less: Fit, now: Fit, term: Term, other: Term, values: tuple[float, ...], data: Data, weights: Weights
) -> Start:
    """The model `now` with `other` in the place of `term` where that does most of it, else `less` (without it) with it.

    From the model without the term the way is long where its effect is large, and valleys lie on it; the whole model,
    with what the term does followed by all that is left and by `other` from `values` on, is near where one curve can
    be written as the other.
    """
    near = _in_place(
        now, term, other, values, data, weights, (less.jacobian, less.free), _effect(now, term, data, weights)
    )
    one = less.more(other, values)
    if near is None:
        return one
    beyond = _left(near, data, weights) - now.chi2
    worth = min(less.chi2, _left(one, data, weights)) - now.chi2
    return near if beyond < NEAR * worth else one


def best_forms(fitted: Fit, terms: Sequence[Term], data: Data, weights: Weights, noise: Noise) -> Fit:
    """The same effects, each in the textbook form that fits best beside the others; `fitted` where that is as it is.

    A form is chosen while other effects are still missing, and what is added later makes up for a wrong one: so it is
    asked again whenever the model changes.
    """
    for term in fitted.model.terms:
        for other in terms:
            if other.id == term.id and other not in fitted.model.terms and may_replace(term, other, fitted.model):
                better = _better_form(fitted, term, other, data, weights, noise)
                if better is not fitted:
                    fitted, term = better, other  # noqa: PLW2901  # the next form is asked in the place of this one
    return fitted


def may_replace(term: Term, other: Term, model: Model) -> bool:
    """Whether `other` is one that may stand where `term` does: a closer form does for forms of its effect only."""
    if not other.traits.closer:
        return True
    told = other.traits.own_winding and any(t.traits.winding for t in model.terms)
    return other.id == term.id and not told


def beginnings(term: Term, values: tuple[float, ...], other: Term, scale: Scale) -> tuple[tuple[float, ...], ...]:
    """Trials of `other` in the place of `term` at its `values`: a closer form begins at these, if it has them all."""
    trials, many = other.trials(scale), len(values)
    names = [[p.name for p in each.parameters(scale)] for each in (term, other)]
    if not other.traits.closer or names[1][:many] != names[0]:
        return trials
    return tuple(dict.fromkeys((*values, *trial[many:]) for trial in trials))


def _better_form(now: Fit, term: Term, other: Term, data: Data, weights: Weights, noise: Noise) -> Fit:
    """The other of two forms where its BIC is less, of a rare one by far, and nothing contradicts it. What stands for a
    channel of a few steps need not be better than what those say, nor the usual one of two that do as well."""
    logn = float(np.log(max(now.residual.size, 2)))
    wanted = now.chi2 - policy.select.RIVAL_BETTER_BIC - (price(other, data) - price(term, data)) * logn
    wanted += 2 * policy.select.RIVAL_BETTER_BIC * int(usual_form(other, term, data.scale))
    coarser = np.sign(hidden_by_steps(other, data) - hidden_by_steps(term, data))
    wanted -= policy.select.RARE_TERM_BIC * (coarser or int(other.traits.rare and not term.traits.rare))
    own = now.layout.of(term)
    kept = np.array([j < own.start or j >= own.stop for j in range(now.free.size)])
    slopes = now.jacobian[:, kept[now.free]], now.free[kept]
    trials = beginnings(term, now.values[term], other, data.scale)
    effect = _effect(now, term, data, weights)
    starts = [_in_place(now, term, other, values, data, weights, slopes, effect) for values in trials]
    possible = [start for start in starts if start is not None]
    if not possible:
        return now
    begin = min(possible, key=lambda start: _left(start, data, weights))
    new = fit(*begin, data, weights, FORM_STEPS, wanted, near=now)
    if new.chi2 >= wanted or at_bound(other, new, data, weights) or contradiction(new, other, noise, data):
        return now
    return new


def _left(start: Start, data: Data, weights: Weights) -> float:
    residual = residual_of(*start, data, weights)
    chi2 = float(residual @ residual)
    return chi2 if np.isfinite(chi2) else np.inf


def _effect(now: Fit, term: Term, data: Data, weights: Weights) -> Floats:
    """(n,) whitened change that the term makes at its fitted values."""
    return weights.whiten(*change_of(now.less(term), (now.model, now.theta), data, weights))


def _in_place(
    now: Fit,
    term: Term,
    other: Term,
    values: tuple[float, ...],
    data: Data,
    weights: Weights,
    slopes: tuple[Floats, NDArray[np.bool_]],
    effect: Floats,
) -> Start | None:
    """None where `other` cannot be had in any amount. `slopes`: of the rest of the model, and of which values; `effect`
    (n,): whitened, what `term` does.

    The rest follows by its slopes where that leaves less, else it stays: the step is long where two are nearly one
    curve, as a delay and a lag on a sine beside an inflow, and ends far off.
    """
    rest, theta = now.less(term)
    bigger, begun = extended(rest, theta, other, values)
    change = weights.whiten(*change_of((rest, theta), (bigger, begun), data, weights))
    size = float(np.linalg.norm(change))
    if size == 0 or not np.isfinite(size):
        return None
    columns, free = slopes
    steps = _followed(np.column_stack([columns, change / size]), effect)
    moved = theta.vector
    moved[free] += steps[:-1]
    followed = _begun((rest, theta.with_vector(moved)), other, values, steps[-1] / size, data)
    alone = _begun((rest, theta), other, values, float(effect @ change) / size**2, data)
    return min(followed, alone, key=lambda start: _left(start, data, weights))


def _begun(rest: Start, other: Term, values: tuple[float, ...], share: float, data: Data) -> Start:
    """The `rest` with `other`, of whose amount in a trial's `values` there is a `share`, all within bounds."""
    first = other.parameters(data.scale)[0]
    assert first.neutral is not None
    amount = first.neutral + share * (values[0] - first.neutral)
    bigger, start = extended(*rest, other, (float(np.clip(amount, first.low, first.high)), *values[1:]))
    low, high, _ = bounds_of(bigger, data, start)
    return bigger, start.with_vector(np.clip(start.vector, low, high))


def _followed(columns: Floats, target: Floats) -> Floats:
    """(p,) least squares by columns of any size; what they cannot tell apart is left small."""
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0, size, 1.0)
    found: Floats = np.linalg.lstsq(columns / size, target, rcond=1e-6)[0] / size
    return found
