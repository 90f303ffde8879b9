"""A twin as the baseline of a diagnosis, and a diagnosis as a twin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from identification.mismatch.estimate.fitting import raw
from identification.mismatch.model.data import Data, PriorPredictionFactor
from identification.mismatch.model.model import Given, Model
from identification.mismatch.model.parameters import Theta
from identification.recording import Floats
from identification.twin import Twin

PROBE = 0.1
"""Standard deviations by which a parameter is moved for the slope of the prediction."""


def given(twin: Twin) -> tuple[Given, ...]:
    return tuple(Given(t.term, t.values, t.scale) for t in twin.terms)


def starting(twin: Twin) -> Callable[[Data, Theta], tuple[Data, Theta, Model]]:
    """For search(): the twin's terms at their values, C of the twin to begin with, and how uncertain they are."""

    def begin(data: Data, theta: Theta) -> tuple[Data, Theta, Model]:
        model = Model((), given(twin))
        theta = replace(theta, C=twin.C)
        return replace(data, prior_factor=_both(data.prior_factor, prior_factor(twin, data, theta))), theta, model

    return begin


def _both(one: PriorPredictionFactor | None, other: PriorPredictionFactor | None) -> PriorPredictionFactor | None:
    if one is None or other is None:
        return one or other
    thrust = tuple(np.column_stack(pair) for pair in zip(one.thrust, other.thrust, strict=True))
    rate = tuple(np.column_stack(pair) for pair in zip(one.rate, other.rate, strict=False))
    return PriorPredictionFactor(thrust, rate)


def prior_factor(twin: Twin, data: Data, theta: Theta) -> PriorPredictionFactor | None:
    """Change of the prediction by one standard deviation along each principal axis of the terms' covariance.

    C is fitted anew in each diagnosis, so its own uncertainty is not in it.
    """
    covariance = np.array(twin.covariance)[1:, 1:]
    if not covariance.size:
        return None
    std = np.sqrt(np.diag(covariance))
    moving = std > 0
    values, axes = np.linalg.eigh(covariance[np.ix_(moving, moving)] / np.outer(std[moving], std[moving]))
    root = np.zeros((std.size, values.size))
    root[moving] = std[moving, None] * axes * np.sqrt(np.maximum(values, 0.0))
    base, base_rate = raw(Model((), given(twin)), theta, data, with_rate=data.with_rate)
    thrust: list[list[Floats]] = [[] for _ in data.histories]
    rate: list[list[Floats]] = [[] for _ in data.histories]
    for axis in root.T:
        moved = Model((), given(_moved(twin, PROBE * axis)))
        new, new_rate = raw(moved, theta, data, with_rate=data.with_rate)
        for out, a, b in zip(thrust, new, base, strict=True):
            out.append((a - b) / PROBE)
        for out, a, b in zip(rate, new_rate, base_rate, strict=False):
            out.append((a - b) / PROBE)
    if not root.shape[1]:
        return None
    return PriorPredictionFactor(
        tuple(np.column_stack(c) for c in thrust), tuple(np.column_stack(c) for c in rate if c)
    )


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
