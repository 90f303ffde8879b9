"""Terms that are not claimed and not ruled out either: beside one of them C would be another."""

from __future__ import annotations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.locate.stage import Located
from identification.mismatch.model.data import price
from identification.mismatch.select.exchange.rivals import RIVAL_STEPS
from identification.mismatch.select.forward_selection import Selected
from identification.mismatch.select.stepwise import RivalTerm
from identification.physics.term import Term

MOST_UNCLAIMED = 3
"""Terms that are fitted beside the model, the clearest first."""


def unclaimed(selected: Selected, located: Located) -> list[RivalTerm[Term, Fit]]:
    """Of the last screening, which passed nothing: what is seen in it all the same and within reach by its BIC.

    What a slow noise half hides may be too little for a name, and enough to move C by several of its errors.
    """
    last, now, data = selected.last, located.estimate, selected.data
    if last is None or now is not selected.after:
        return []
    logn, out = float(np.log(max(now.fit.residual.size, 2))), []
    for term, values, sigma in last.best(MOST_UNCLAIMED, share=0.0):
        own = [z for t, z in zip(last.directions.terms, last.z.tolist(), strict=True) if t == term]
        if sigma < policy.select.HIDDEN_FIRST_TERM_SIGMA or max(own) < policy.select.HIDDEN_SIGMA:
            continue
        cost = price(term, data) * logn
        hopeless = now.fit.chi2 + policy.select.RIVAL_STATED_BIC - cost
        new = fit(*now.fit.more(term, values), data, now.weights, RIVAL_STEPS, hopeless, near=now.fit)
        loss = new.chi2 - now.fit.chi2 + cost
        if loss < policy.select.RIVAL_STATED_BIC:
            out.append(RivalTerm(term, new, float(loss), float(loss - cost + 2 * price(term, data))))
    return out
