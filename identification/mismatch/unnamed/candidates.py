"""What was not named and yet may be there: of each effect of the catalogue how much the recordings allow.

A second recording of the same thruster may show better what was there before; what is new is the difference.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.model.data import Data
from identification.mismatch.select.screening import Directions, directions
from identification.physics.term import Term
from identification.twin import Candidates, TwinTerm


def candidates_of(
    estimate: Estimate, data: Data, terms: Sequence[Term], known: Directions | None = None
) -> Candidates | None:
    """Amounts of the likeliest trial of each of `terms` beside the model, with their covariance; None of no term.

    All amounts together, linear, each beforehand within CANDIDATE_SIGMA of its own error round 0: several look alike,
    and the data tell only what they do together (ridge regression; Hoerl and Kennard, Technometrics 12, 1970, 55).
    What comes at an instant of this run's own is left out: it lasts for no other. `known`: directions of all trials
    beside this very model.
    """
    fitted = estimate.fit
    inside = {t.id for t in fitted.model.terms} | {g.term.id for g in fitted.model.given}
    lasting = [t for t in terms if t.id not in inside and (t.traits.delay or not t.traits.own_clock)]
    found = directions(fitted, data, estimate.weights, lasting) if known is None else known
    z = found.columns.T @ fitted.residual
    best: dict[Term, int] = {}
    for j in np.argsort(-np.abs(z)).tolist():
        if found.terms[j] in lasting:
            best.setdefault(found.terms[j], j)
    chosen = list(best.values())
    if not chosen:
        return None
    columns, sizes = found.columns[:, chosen], found.sizes[chosen]
    allowed = np.linalg.inv(columns.T @ columns + np.eye(len(chosen)) / policy.compare.CANDIDATE_SIGMA**2)
    covariance = (allowed + allowed.T) / (2 * np.outer(sizes, sizes))
    return Candidates(
        tuple(_trial(found.terms[j], found.values[j], data) for j in chosen),
        tuple((allowed @ z[chosen] / sizes).tolist()),
        tuple(map(tuple, covariance.tolist())),
    )


def _trial(term: Term, values: tuple[float, ...], data: Data) -> TwinTerm:
    names = [p.name for p in term.parameters(data.scale)]
    return TwinTerm(term.id, term.form, dict(zip(names, values, strict=True)), data.scale)
