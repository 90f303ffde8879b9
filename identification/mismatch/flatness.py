"""Where a cell or its amplifier clips, it clips the noise too: the readings are flat there, as no drive makes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.mismatch.fitting import Fit
from identification.mismatch.model import Data, predict
from identification.mismatch.noise import Noise
from identification.physics.term import Term

DEEP = 1.0
"""Standard deviations of the noise beyond the limit: what clips leaves 8 % of the variance there, or less."""
ROUGH = 0.5
"""Share of the noise's variance above which the readings there are not flat."""
LEAST = 10
"""Samples there, below which nothing is said."""


def noise_goes_on(fitted: Fit, term: Term, noise: Noise, data: Data) -> bool:
    """Whether the readings scatter as ever where a load-cell saturation of the model says that they clip."""
    if term.id != "load_cell_saturation":
        return False
    values = dict(zip(fitted.model.terms, fitted.theta.terms, strict=True))
    limit = values[term][0]
    bare = fitted.model.without(term)
    theta = replace(fitted.theta, terms=tuple(values[t] for t in bare.terms))
    left = scatter = samples = 0.0
    for i, (h, rows) in enumerate(zip(data.histories, data.rows, strict=True)):
        whole = predict(bare, theta, h, data.scale, i)[0]
        edges = np.concatenate([whole[:1], 0.5 * (whole[1:] + whole[:-1]), whole[-1:]])
        force, first, last = whole[rows], edges[:-1][rows], edges[1:][rows]
        variance = noise.white + noise.proportional * force**2 + sum(noise.slow) + sum(noise.band)
        for side in (1.0, -1.0):
            reached = np.minimum(side * first, side * last) + side * theta.tares[i]  # not on the way there and back
            deep = reached > limit + DEEP * np.sqrt(variance)
            count, read = h.count[rows][deep].astype(np.float64), h.thrust[rows][deep]
            if count.sum() > 1:
                left += float(count @ (read - np.average(read, weights=count)) ** 2 + h.within[rows][deep].sum())
                scatter += float(count @ variance[deep])
                samples += float(count.sum())
    return samples >= LEAST and left > ROUGH * scatter
