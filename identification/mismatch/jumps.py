"""When the zero may have jumped: every instant is looked at, as no grid of trials can.

Under slow noise a step is seen by what changes within seconds of it: a trial half a minute off sees nothing.
"""

from __future__ import annotations

import numpy as np

from identification.mismatch.fitting import Fit
from identification.mismatch.model import Data, Weights
from identification.recording import Floats

TRIED = 600
"""Instants, evenly over the rows."""
APART = 0.02
"""Share of the longest run between two that are told."""


def likeliest_jumps(fitted: Fit, data: Data, weights: Weights, basis: Floats, most: int) -> tuple[float, ...]:
    """Up to `most` times in s at which a step of the reading explains most of the residual, the best first.

    `basis` (n, p): orthonormal, what the present model can follow.
    """
    runs = [h.sampled[r] for h, r in zip(data.histories, data.rows, strict=True)]
    when = np.unique(np.quantile(np.concatenate(runs), np.linspace(0.01, 0.99, TRIED)))
    steps = [(at[:, None] >= when).astype(np.float64) for at in runs]
    n = data.size
    columns = Weights(weights.thrust).whiten(steps, [])
    columns -= basis[:n] @ (basis[:n].T @ columns)
    size = np.linalg.norm(columns, axis=0)
    score = np.abs(columns.T @ fitted.residual[:n]) / np.where(size > 0, size, np.inf)
    found: list[float] = []
    for j in np.argsort(-score):
        if all(abs(when[j] - other) > APART * data.scale.duration for other in found):
            found.append(float(when[j]))
        if len(found) == most:
            break
    return tuple(found)
