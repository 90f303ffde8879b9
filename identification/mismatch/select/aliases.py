"""Ringing faster than half the sampling rate looks like slower ringing, and a fit may end on either side of it."""

from __future__ import annotations

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import with_values


def within_samples(estimate: Estimate, data: Data) -> Estimate:
    """Of ringing beyond half the sampling rate the alias below it, where that does nearly as well."""
    limit = 0.5 / min(h.spacing for h in data.histories)
    now = estimate.fit
    for term, values in now.values.items():
        if term.id == "stand_resonance" and limit < values[1] < 2 * limit:
            slower = with_values(now.model, now.theta, term, (values[0], 2 * limit - values[1], values[2]))
            found = fit(now.model, slower, data, estimate.weights)
            if found.values[term][1] < limit and found.chi2 < now.chi2 + policy.select.ALIAS_LOSS:
                return refresh(found.model, found.theta, data, None, estimate)
    return estimate
