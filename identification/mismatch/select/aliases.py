"""Ringing faster than half the sampling rate looks like slower ringing, and a fit may end on either side of it."""

from __future__ import annotations

from dataclasses import replace

from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.model import Data

ALIKE = 4.0
"""Of chi-square: a model that loses less by ringing that the samples can show is as good."""


def within_samples(estimate: Estimate, data: Data) -> Estimate:
    """Of ringing beyond half the sampling rate the alias below it, where that does nearly as well."""
    limit = 0.5 / min(h.spacing for h in data.histories)
    for i, (term, values) in enumerate(zip(estimate.fit.model.terms, estimate.fit.theta.terms, strict=True)):
        if term.id == "stand_resonance" and limit < values[1] < 2 * limit:
            found = _slower(estimate.fit, i, (values[0], 2 * limit - values[1], values[2]), data, estimate)
            if found.theta.terms[i][1] < limit and found.chi2 < estimate.fit.chi2 + ALIKE:
                return refresh(found.model, found.theta, data, None, estimate)
    return estimate


def _slower(now: Fit, at: int, values: tuple[float, ...], data: Data, estimate: Estimate) -> Fit:
    terms = (*now.theta.terms[:at], values, *now.theta.terms[at + 1 :])
    return fit(now.model, replace(now.theta, terms=terms), data, estimate.weights)
