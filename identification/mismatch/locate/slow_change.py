"""A slow change of zero or gain that the noise had taken for its own: told from noise by estimating both together.

A residual that wanders once over the run is what slow noise leaves, so a noise estimated on it is as slow as that, and
no test against that noise sees it. The restricted likelihood of noise and change together tells them apart: noise that
wanders so far in one run must be there in every part of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, by_itself, by_run, forces, refreshed_once
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import beside, orthogonal_basis
from identification.mismatch.select.overdispersion import dispersion
from identification.recording import Floats

SLOW, QUICK = 2, 16
"""Degrees of the polynomials over time. Those of the zero are slow: what wanders quicker is noise by any other name."""


def beside_slow_change(estimate: Estimate, data: Data) -> Estimate | None:
    """The same model with its noise estimated beside such a change; None where noise explains the residual as well."""
    if any(h.static for h in data.histories):
        return None
    found = [(p, beside) for p, beside in slow_changes(estimate, data) if p < policy.locate.SLOW_CHANGE_FALSE_ALARM]
    return min(found, key=lambda each: each[0])[1] if found else None


def slow_changes(estimate: Estimate, data: Data) -> list[tuple[float, Estimate]]:
    """The p-value of each kind of change, and the model with its noise estimated beside it."""
    now = by_itself(estimate, data)
    found = []
    for columns in slow_columns(now, data):
        beside = refreshed_once(now.fit.model, now.fit.theta, data, columns, now, now.noise)
        taken, noisier = _taken(beside, data, columns)
        gain = now.fit.deviance - beside.fit.deviance + taken
        found.append((float(chi2_sf(gain / noisier, columns.shape[1])), beside))
    return found


def slow_columns(estimate: Estimate, data: Data) -> tuple[Floats, ...]:
    """(n, degree x runs) Legendre polynomials of time at the rows, run by run: of the zero, and times the force."""
    force = forces(estimate.fit.model, estimate.fit.theta, data)
    shapes, gains = [], []
    for history, rows, size in zip(data.histories, data.rows, force, strict=True):
        time = history.middle[rows]
        across = 2 * (time - time[0]) / max(float(time[-1] - time[0]), 1e-9) - 1
        shapes.append(np.polynomial.legendre.legvander(across, QUICK)[:, 1:])
        gains.append(shapes[-1] * (size / data.scale.thrust)[:, None])
    slow = [_each_its_own([part[:, :SLOW] for part in parts]) for parts in (shapes, gains)]
    return (*slow, _each_its_own(gains))


def _each_its_own(parts: Sequence[Floats]) -> Floats:
    """Columns of every run beside each other, zero in the other runs' rows."""
    ends = np.cumsum([0, *(p.shape[0] for p in parts)])
    degree = parts[0].shape[1]
    out = np.zeros((int(ends[-1]), degree * len(parts)))
    for i, part in enumerate(parts):
        out[ends[i] : ends[i + 1], degree * i : degree * (i + 1)] = part
    return out


def span_of(columns: Floats, estimate: Estimate, data: Data) -> Floats:
    """(n, r) orthonormal basis of what raw columns (n, p) of all runs take beside the model's own, whitened."""
    whitened = Weights(estimate.weights.thrust).whiten(by_run(columns, data), [])
    return orthogonal_basis(beside(whitened, orthogonal_basis(estimate.fit.jacobian[: data.size])))


def _taken(estimate: Estimate, data: Data, columns: Floats) -> tuple[float, float]:
    """Of the whitened residual's square by the columns beside the model's own; and how much noisier it is there than
    the noise's model has it."""
    span, residual = span_of(columns, estimate, data), estimate.fit.residual[: data.size]
    score = span.T @ residual
    return float(score @ score), dispersion(span, residual)
