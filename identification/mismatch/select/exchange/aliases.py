"""Ringing faster than half the sampling rate looks like slower ringing, and a fit may end on either side of it."""

from __future__ import annotations

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import with_values
from identification.physics.term import Term


def within_samples(estimate: Estimate, data: Data) -> Estimate:
    """Of ringing beyond half the sampling rate the alias below it, where that does nearly as well."""
    limit = 0.5 / min(h.spacing for h in data.histories)
    now = estimate.fit
    for term, values in now.values.items():
        at = _place(term, data)
        if at is not None and limit < values[at] < 2 * limit:
            mirrored = (*values[:at], 2 * limit - values[at], *values[at + 1 :])
            found = fit(now.model, with_values(now.model, now.theta, term, mirrored), data, estimate.weights)
            if found.values[term][at] < limit and found.chi2 < now.chi2 + policy.select.ALIAS_LOSS:
                return refresh(found.model, found.theta, data, None, estimate)
    return estimate


def _place(term: Term, data: Data) -> int | None:
    """Of its frequency among its parameters."""
    if not term.traits.frequency:
        return None
    return [p.name for p in term.parameters(data.scale)].index(term.traits.frequency)
