"""A twin as the baseline of a diagnosis, and a diagnosis as a twin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import sqrt
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from identification.flexible_terms.flexible import Flexible
from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.data import Data, PriorPredictionFactor
from identification.mismatch.model.model import Given, Model, acting
from identification.mismatch.model.parameters import Theta
from identification.physics.catalogue import CATALOGUE
from identification.physics.traits import SpreadJump
from identification.recording import Floats, Recording
from identification.twin import Twin, TwinTerm, names_of

PROBE = 0.1
"""Standard deviations by which a parameter is moved for the slope of the prediction."""
STAIRS = ndtri((np.arange(8) + 0.5) / 8)
"""Standard deviations by which one is moved at which the prediction jumps: as many equally likely places of it."""


def given(twin: Twin) -> tuple[Given, ...]:
    """A twin's terms with their values fixed, as a model takes them for its baseline."""
    return _given(twin.terms)


def _given(terms: Sequence[TwinTerm]) -> tuple[Given, ...]:
    """A threshold that is known is sharp: what is spread for a fit turns the rotor half at a level beside it."""
    return tuple(
        Given(cast(SpreadJump, t.term).sharp() if t.known and t.term.traits.spread else t.term, t.values, t.scale)
        for t in terms
    )


def terms_of(fitted: Fit, data: Data) -> tuple[TwinTerm, ...]:
    """Of a fitted model, as a twin has them, in the order in which they act."""
    return tuple(
        TwinTerm(
            term.id,
            term.form,
            {p.name: value for p, value in zip(term.parameters(sizes), values, strict=True)},
            sizes,
            term if isinstance(term, Flexible) else None,
        )
        for term, values, sizes in acting(fitted.model, fitted.theta, data.scale)
    )


def starting(twin: Twin) -> Callable[[Data, Theta], tuple[Data, Theta, Model]]:
    """For search(): the twin's terms at their values, C and the rate per driver of the twin to begin with, and how
    uncertain they are: what a term changes of thrust and rate goes together, and a winding's rate is not its driver's.
    """

    def begin(data: Data, theta: Theta) -> tuple[Data, Theta, Model]:
        model = Model((), given(twin))
        theta = replace(theta, C=twin.C, k=theta.k if twin.rate_per_driver is None else twin.rate_per_driver)
        own = prior_factor(twin, data, theta)
        unsure = _both(data.prior_factor, own)
        before = (twin.C, sqrt(twin.covariance[0][0]))
        return replace(data, prior_factor=unsure, twin_factor=own, constant_before=before), theta, model

    return begin


def _both(one: PriorPredictionFactor | None, other: PriorPredictionFactor | None) -> PriorPredictionFactor | None:
    if one is None or other is None:
        return one or other
    thrust = tuple(np.column_stack(pair) for pair in zip(one.thrust, other.thrust, strict=True))
    rate = tuple(np.column_stack(pair) for pair in zip(one.rate, other.rate, strict=False))
    return PriorPredictionFactor(thrust, rate)


def lasting(twin: Twin, recordings: Sequence[Recording]) -> Twin:
    """The twin for other recordings than its own: without terms that are of one run's own time (a jump of the zero)."""
    ids = {source.recording_id for source in twin.sources}
    of_the_run = [t.known and t.term.traits.own_clock and not t.term.traits.delay for t in twin.terms]
    if not any(of_the_run) or any(r.recording_id in ids for r in recordings):
        return twin
    stays = [True]
    for term, left_out in zip(twin.terms, of_the_run, strict=True):
        stays += [not left_out] * len(term.values)
    kept = np.flatnonzero(stays)
    terms = tuple(t for t, left_out in zip(twin.terms, of_the_run, strict=True) if not left_out)
    covariance = np.array(twin.covariance)[np.ix_(kept, kept)]
    return replace(twin, terms=terms, names=names_of(terms), covariance=tuple(map(tuple, covariance.tolist())))


def prior_factor(twin: Twin, data: Data, theta: Theta) -> PriorPredictionFactor | None:
    """How the prediction may be off, each direction one standard deviation long.

    Along each principal axis of the terms' covariance; to where else a threshold or an instant may lie; towards what
    each other textbook form would have said; and in proportion to what each term does. C is fitted anew in each
    diagnosis, so its own uncertainty is not in it.
    """
    base = raw(Model((), given(twin)), theta, data, with_rate=data.with_rate)
    moves = [*_along_axes(twin, theta, data, base), *_past_stairs(twin, theta, data, base)]
    moves += [*_towards_forms(twin, theta, data, base), *_in_proportion(twin, theta, data, base)]
    if not moves:
        return None
    thrust = tuple(np.column_stack(columns) for columns in zip(*(move[0] for move in moves), strict=True))
    rate = tuple(np.column_stack(columns) for columns in zip(*(move[1] for move in moves), strict=True))
    return PriorPredictionFactor(thrust, rate)


Predicted = tuple[list[Floats], list[Floats]]
"""Of thrust and rate, run by run."""


def _along_axes(twin: Twin, theta: Theta, data: Data, base: Predicted) -> list[Predicted]:
    covariance = np.array(twin.covariance)[1:, 1:]
    if not covariance.size:
        return []
    std = np.sqrt(np.diag(covariance))
    moving = (std > 0) & ~_jumping(twin)
    values, axes = np.linalg.eigh(covariance[np.ix_(moving, moving)] / np.outer(std[moving], std[moving]))
    root = np.zeros((std.size, values.size))
    root[moving] = std[moving, None] * axes * np.sqrt(np.maximum(values, 0.0))
    models = [Model((), given(_moved(twin, PROBE * axis))) for axis in root.T]
    return [_change(model, theta, data, base, 1 / PROBE) for model in models]


def _jumping(twin: Twin) -> NDArray[np.bool_]:
    """(q,) at which parameters of the terms the prediction jumps."""
    return np.array([p.jumps for t in twin.terms for p in t.term.parameters(t.scale)], dtype=bool)


def _past_stairs(twin: Twin, theta: Theta, data: Data, base: Predicted) -> list[Predicted]:
    """No slope leads from one stair to the next: the prediction at places of the parameter, in the mean of them."""
    std = np.sqrt(np.diag(np.array(twin.covariance)))[1:]
    out = []
    for j in np.flatnonzero(_jumping(twin) & (std > 0)):
        for far in STAIRS:
            moved = np.zeros(std.size)
            moved[j] = far * std[j]
            out.append(_change(Model((), given(_moved(twin, moved))), theta, data, base, 1 / sqrt(len(STAIRS))))
    return out


def _towards_forms(twin: Twin, theta: Theta, data: Data, base: Predicted) -> list[Predicted]:
    """No further than a form may have been off in the twin's own run."""
    out = []
    for other in twin.alternatives:
        most = policy.compare.FORM_ERROR_SIGMA + policy.compare.FORM_ERROR * sqrt(max(other.gain, 0.0))
        far = min(1.0, most / sqrt(max(other.loss, 1e-12)))
        model = Model((), _given(other.terms))
        out.append(_change(model, replace(theta, C=theta.C * other.C / twin.C), data, base, far))
    return out


def _in_proportion(twin: Twin, theta: Theta, data: Data, base: Predicted) -> list[Predicted]:
    every = given(twin)
    less = [Model((), every[:i] + every[i + 1 :]) for i in range(len(every))]
    shares = _form_errors(twin)
    return [_change(model, theta, data, base, share) for model, share in zip(less, shares, strict=True)]


def _form_errors(twin: Twin) -> list[float]:
    """Of each term, as a share of what it changes: no more than its own run could tell of its amount, all else known,
    for a larger one would have been seen there. What no run told has the error of a form, if it has several."""
    told = _told_alone(twin)
    out, at = [], 0
    for term in twin.terms:
        known = term.term.parameters(term.scale)
        amounts = [
            s / abs(v - p.neutral)
            for p, v, s in zip(known, term.values, told[at : at + len(known)], strict=True)
            if p.neutral is not None and v != p.neutral and (s > 0.0 or _has_one_form(term))
        ]
        at += len(known)
        out.append(min([policy.compare.FORM_ERROR, *([] if term.flexible else amounts)]))
    return out


def _has_one_form(term: TwinTerm) -> bool:
    return sum(each.id == term.effect for each in CATALOGUE) == 1


def _told_alone(twin: Twin) -> list[float]:
    """(q,) standard deviation of each parameter of the terms were all others known; 0 where it was not fitted."""
    covariance = np.array(twin.covariance)[1:, 1:]
    out = np.sqrt(np.diag(covariance))
    moving = out > 0
    scaled = covariance[np.ix_(moving, moving)] / np.outer(out[moving], out[moving])
    out[moving] /= np.sqrt(np.maximum(np.diag(np.linalg.pinv(scaled, hermitian=True)), 1.0))
    return cast(list[float], out.tolist())


def _change(model: Model, theta: Theta, data: Data, base: Predicted, times: float) -> Predicted:
    new = raw(model, theta, data, with_rate=data.with_rate)
    thrust, rate = ([times * (a - b) for a, b in zip(x, y, strict=True)] for x, y in zip(new, base, strict=True))
    return thrust, rate


def _moved(twin: Twin, by: Floats) -> Twin:
    """The twin with its terms' parameters moved, within their bounds."""
    at, terms = 0, []
    for term in twin.terms:
        known = term.term.parameters(term.scale)
        moved = {
            p.name: float(np.clip(value + step, p.low, p.high))
            for p, value, step in zip(known, term.values, by[at : at + len(known)], strict=True)
        }
        terms.append(replace(term, parameters=moved))
        at += len(known)
    return replace(twin, terms=tuple(terms))
