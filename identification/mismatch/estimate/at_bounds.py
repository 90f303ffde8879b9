"""Whether a parameter is pressed against the end of what is physically possible."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.estimation.singular_values import thin_svd
from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, columns_of
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.physics.term import Parameter, Scale, Term


def at_bound(term: Term, fitted: Fit, data: Data, weights: Weights) -> bool:
    """Whether a parameter is pressed against the end of what is physically possible.

    One that merely lies there, because the data say little of it, is not: beyond the end the fit would be no better.
    """
    begin, values = fitted.layout.of(term).start, fitted.values[term]
    known = term.parameters(data.scale)
    if out_of_the_question(term, values, data.scale):
        return True
    return any(
        _ends(p, value) and abs(_push(begin + j, fitted, data, weights)) > policy.estimate.PRESSED_AT_BOUND_SIGMA
        for j, (p, value) in enumerate(zip(known, values, strict=True))
    )


def out_of_the_question(term: Term, values: tuple[float, ...], scale: Scale) -> bool:
    """Whether a term ends at what is physically possible, or beyond what its values can be together."""
    too_much = term.traits.too_much
    return impossible(term.parameters(scale), values) or (too_much is not None and too_much(term, values, scale.driver))


def impossible(known: Sequence[Parameter], values: Sequence[float]) -> bool:
    """Whether the amount of a term, or all that is inner of it, ends at what is physically possible."""
    ended = [(p, _ends(p, value)) for p, value in zip(known, values, strict=True)]
    inner = [end for p, end in ended if p.neutral is None]
    return (bool(inner) and all(inner)) or any(end and p.neutral is not None for p, end in ended)


def _ends(p: Parameter, value: float) -> bool:
    """Whether a value sits at a bound that does not mean that the term is absent."""
    edge = 1e-3 * (p.high - p.low)
    return (value <= p.low + edge and p.neutral != p.low) or (
        value >= p.high - edge and p.neutral != p.high and not p.whole
    )


def _push(j: int, fitted: Fit, data: Data, weights: Weights) -> float:
    """Sigmas by which the residual asks for more of parameter j, beside all that was free."""
    which = np.zeros(fitted.free.size, dtype=bool)
    which[j] = True
    column = columns_of(fitted.model, fitted.theta, data, weights, which)[:, 0]
    u, s, _ = thin_svd(fitted.jacobian)
    u = u[:, s > 1e-9 * s[0]] if s.size else u
    rest = column - u @ (u.T @ column)
    size = float(np.linalg.norm(rest))
    return float(rest @ fitted.residual) / size if size > 1e-6 * float(np.linalg.norm(column)) else 0.0
