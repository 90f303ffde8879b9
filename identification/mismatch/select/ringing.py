"""Resonances that the ticks of the command point to: many more are tried on their few rows than on all."""

from __future__ import annotations

import numpy as np

from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import acting
from identification.mismatch.model.step_response import told
from identification.physics.term import Term
from identification.recording import Floats

APART = 4.0
"""Hz: what is followed for a tenth of a second tells no finer."""
SHARP, DULL = 0.05, 0.3
"""Damping."""
LOWEST = 5.0
"""Hz: what rings more slowly is among the term's own trials."""


def likeliest_rings(fitted: Fit, data: Data, term: Term, most: int) -> tuple[tuple[float, ...], ...]:
    """Up to `most` trials of a stand_resonance, the best of each damping first."""
    highest = term.parameters(data.scale)[1].high
    rows = sum(each.target.size for each in data.ticks)
    residual = fitted.residual[fitted.residual.size - rows :]
    base = _told(fitted, data, None)
    out: list[tuple[float, ...]] = []
    for damping, tried in (
        (SHARP, np.arange(LOWEST, highest, APART)),
        (DULL, np.geomspace(LOWEST, max(highest, 2 * LOWEST), 18)),
    ):
        trials = [(1.0, float(f), damping) for f in tried]
        change = np.column_stack([_told(fitted, data, (term, values)) - base for values in trials])
        size = np.linalg.norm(change, axis=0)
        score = np.abs(change.T @ residual) / np.where(size > 0, size, np.inf)
        out += [trials[j] for j in np.argsort(-score)[: most // 2]]
    return tuple(out)


def _told(fitted: Fit, data: Data, more: tuple[Term, tuple[float, ...]] | None) -> Floats:
    terms = acting(fitted.model, fitted.theta, data.scale)
    if more is not None:
        terms = [*terms, (*more, data.scale)]
    return np.concatenate([told(rows, terms, fitted.theta.C, fitted.theta.shift) for rows in data.ticks])
