"""The shape of a flexible term with its error, beside what was measured in bins of its covariate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.flexible_terms.flexible import WORDS, Flexible, Multiplier
from identification.mismatch.diagnosis import HeldOutRmse
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.unexplained import FlexibleShape, Remainder, Spline
from identification.mismatch.unnamed.flexible import Extended
from identification.mismatch.unnamed.flexible_knots import seen_at
from identification.mismatch.unnamed.formula import find_formula
from identification.mismatch.value import Value, of_shape
from identification.physics.term import Term
from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.splines import spline

POINTS = 81
"""Points at which a shape is told: a line through them looks smooth."""
MOST_LEVELS = 24
"""Values of a covariate that are bins each, at most; more are shared out evenly."""
BINS = 14
"""Bins of the table of a shape over a covariate without levels."""


def shapes_of(extended: Extended, data: Data) -> tuple[FlexibleShape, ...]:
    """In the order in which they were found."""
    weights = Weights(extended.estimate.weights.thrust)
    return tuple(shape_of(term, extended.estimate.fit, data, weights) for term in extended.terms)


def shape_of(term: Flexible, fitted: Fit, data: Data, weights: Weights) -> FlexibleShape:
    """Coefficients, curves and binned measurements of one flexible term of a fit."""
    theta, inside = fitted.values[term], fitted.layout.of(term)
    covariance = np.nan_to_num(fitted.cov[inside, inside])
    std = np.sqrt(np.diag(covariance))
    known = term.parameters(data.scale)
    return FlexibleShape(
        term.quantity,
        term.unit,
        term.knots,
        term.degree,
        term.memory,
        term.period,
        of_shape({p.name: Value(v, float(s), p.unit) for p, v, s in zip(known, theta, std, strict=True)}),
        tuple(_splines(term, theta, covariance, fitted, data, weights)),
        term.statement(theta, data.scale),
    )


def _splines(
    term: Flexible, theta: Sequence[float], covariance: Floats, fitted: Fit, data: Data, weights: Weights
) -> list[Spline]:
    knots = np.array(term.knots)
    low, high = float(knots[0]), float(knots[-1])
    spread_out = term.quantity == "time_since_step"
    fine = np.geomspace(low, high, POINTS) if spread_out else np.linspace(low, high, POINTS)
    middle, measured, error = _measured(term, fitted, data, weights)
    out = []
    for i, m in enumerate(term.times):
        curve, band = _values(term, m, theta, covariance, fine)
        there, _ = _values(term, m, theta, covariance, middle)
        table = tuple(
            (float(a), float(v), float(w), float(s))
            for a, v, w, s in zip(middle, there, measured[i], error[i], strict=True)
        )
        out.append(Spline(m, WORDS[m], term.unit_of(m, data.scale), fine, curve, band, table))
    return out


def _values(
    term: Flexible, multiplier: Multiplier, theta: Sequence[float], covariance: Floats, over: Floats
) -> tuple[Floats, Floats]:
    """The spline of one multiplier and its standard error, at `over` (n,)."""
    at = 0
    for m in term.times:
        if m == multiplier:
            break
        at += len(term.free(m))
    free = list(term.free(multiplier))
    inside = slice(at, at + len(free))
    basis = spline(term.axis(over), term.axis(np.array(term.knots)), np.eye(len(term.knots)), term.degree)[:, free]
    variance = np.einsum("ni,ij,nj->n", basis, covariance[inside, inside], basis)
    return basis @ np.array(theta[inside]), np.sqrt(np.maximum(variance, 0.0))


def _measured(term: Flexible, fitted: Fit, data: Data, weights: Weights) -> tuple[Floats, Floats, Floats]:
    """Middles of the bins (b,), and generalised least squares of the residual without the term there: values and
    standard errors (multipliers, b)."""
    smaller, theta = fitted.less(term)
    less = replace(fitted, model=smaller, theta=theta)
    over, columns = seen_at(term, less, data)
    thrust, _ = raw(smaller, theta, data, with_rate=False)
    left = weights.whiten([y - f for y, f in zip(data.thrust, thrust, strict=True)], [])
    edges = _edges(np.concatenate(over))
    bins, p = edges.size - 1, len(term.times)
    made = []
    for values, times in zip(over, columns, strict=True):
        index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, bins - 1)
        inside = (index[:, None] == np.arange(bins)).astype(np.float64)
        made.append(np.column_stack([inside * times[:, [j]] for j in range(p)]))
    white = weights.whiten(made, [])
    size = np.linalg.norm(white, axis=0)
    seen = size > 1e-6 * float(size.max(initial=0.0))
    unit = white / np.where(seen, size, np.inf)
    inverse = np.linalg.pinv(unit.T @ unit, hermitian=True, rcond=1e-9)
    value = (inverse @ (unit.T @ left) / np.where(seen, size, np.inf)).reshape(p, bins)
    error = (np.sqrt(np.maximum(np.diag(inverse), 0.0)) / np.where(seen, size, np.inf)).reshape(p, bins)
    every = np.concatenate(over)
    index = np.clip(np.searchsorted(edges, every, side="right") - 1, 0, bins - 1)
    rows = np.bincount(index, minlength=bins)
    middle = np.bincount(index, weights=every, minlength=bins) / np.maximum(rows, 1)
    full = (rows > 0) & seen.reshape(p, bins).all(axis=0)
    return middle[full], value[:, full], error[:, full]


def _edges(values: Floats) -> Floats:
    """Levels where there are few, otherwise shares of the rows."""
    size = float(np.max(np.abs(values), initial=0.0)) or 1.0
    levels = np.unique(np.round(values / size, 4)) * size
    if levels.size <= MOST_LEVELS:
        middle = 0.5 * (levels[1:] + levels[:-1])
        return np.concatenate([[levels[0] - 1e-3 * size], middle, [levels[-1] + 1e-3 * size]])
    out: Floats = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    return out


CURVE = frozenset({"command_voltage", "motor_voltage", "rotation_rate", "thrust", "direction"})


def with_flexible(found: Remainder, extended: Extended | None, data: Data, others: Sequence[History]) -> Remainder:
    """What is unexplained, with the flexible terms that model it, and a formula where one agrees everywhere."""
    if extended is None:
        return found
    shapes = shapes_of(extended, data)
    over = " and ".join(dict.fromkeys(s.covariate for s in shapes))
    names = " and ".join(t.id.replace("_", " ") for t in extended.dropped)
    better = extended.held < extended.without
    how = "carries it" if better or not names else f"predicts about as well as {names}, and claims less"
    says = f"A free curve over {over} (of any shape, no physics) {how}."
    if extended.equals:
        says += f" Over {' or '.join(extended.equals)} it does about as well: this plan cannot tell them apart."
    return replace(
        found,
        statement=f"{found.statement} {says}",
        flexible=shapes,
        equals=extended.equals,
        replaces=tuple(t.id for t in extended.dropped),
        heldout_without=extended.without,
        formula=find_formula(extended, data, others),
    )


def with_held(held: HeldOutRmse, extended: Extended | None) -> HeldOutRmse:
    """The error on what was not fitted; flexible terms were chosen without the data that judge them."""
    if extended is None:
        return held
    what = f"{held.what}; the free curves were chosen and fitted without the data that judge them"
    return replace(held, after=extended.held, what=what)


def shared(terms: Sequence[Term], extended: Extended) -> list[Term]:
    """Of these terms those that change what a flexible one changes, over the same covariate: beside a shape that may
    be anything their values mean nothing."""
    over = {q for term in extended.terms for q in _also(term.quantity)}
    return [term for term in terms if over & {q for c in term.covariates for q in _also(c)}]


def _also(quantity: str) -> frozenset[str]:
    """Coordinates of the same kind: the static curve is one over all that drives."""
    return CURVE if quantity in CURVE else frozenset({quantity})
