"""The budget for shape error: a textbook shape is trusted to a few per cent of its own correction, no further.

What is left where a found term changes much may be the rest of its true shape; it is no new physics and no structure
until it is more than this share of the change. Else every real recording would end unexplained.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, change_of
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.recording import Floats


def corrections(fitted: Fit, data: Data, weights: Weights) -> list[Floats]:
    """Whitened (n,) change that each term makes beside what C and the tares can follow; the rate too if it counts."""
    return _changes([fitted.less(term) for term in fitted.model.terms], fitted, data, weights)


def of_twin(fitted: Fit, data: Data, weights: Weights) -> list[Floats]:
    """The same of each term that a twin gave, as much less as its shape is trusted more than that of one found."""
    every = fitted.model.held
    less = [(replace(fitted.model, given=every[:i] + every[i + 1 :]), fitted.theta) for i in range(len(every))]
    share = policy.compare.TWIN_SHAPE_ERROR / policy.select.SHAPE_ERROR
    return [share * change for change in _changes(less, fitted, data, weights)]


def _changes(less: Sequence[tuple[Model, Theta]], fitted: Fit, data: Data, weights: Weights) -> list[Floats]:
    """From each of the models in `less` to the one that was fitted."""
    n = fitted.residual.size if weights.rate or weights.ticks else data.size
    basis = orthogonal_basis(fitted.jacobian[:n, ~_of_terms(fitted)])
    out = []
    for other in less:
        change = weights.whiten(*change_of(other, (fitted.model, fitted.theta), data, weights))
        out.append(change - basis @ (basis.T @ change))
    return out


def _of_terms(fitted: Fit) -> NDArray[np.bool_]:
    """(p,) which columns of the Jacobian are parameters of terms."""
    of_terms = np.zeros(fitted.free.size, dtype=bool)
    of_terms[fitted.layout.of_terms] = True
    return of_terms[fitted.free]


def allowed(changes: list[Floats], columns: Floats, share: float) -> Floats:
    """(q,) sigmas that shape error may put into unit columns (n, q): no more than it has where they are."""
    out = np.zeros(columns.shape[1])
    size = np.abs(columns)
    for change in changes:
        out += share * np.minimum(np.abs(change) @ size, float(np.linalg.norm(change)))
    return out


def allowed_in(changes: list[Floats], span: Floats) -> float:
    """Chi-square that shape error may put into an orthonormal span (n, q) of all."""
    most = policy.select.SHAPE_ERROR**2 * float(sum(change @ change for change in changes))
    return min(float(np.sum(allowed(changes, span, policy.select.SHAPE_ERROR) ** 2)), most)
