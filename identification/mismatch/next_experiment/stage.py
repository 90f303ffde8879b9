"""The stage: an answer that is still open in, the sweep that settles it out."""

from __future__ import annotations

from collections.abc import Sequence

from identification.mismatch import policy
from identification.mismatch.diagnosis import NextExperiment
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.model.data import Data
from identification.mismatch.name.naming import Named
from identification.mismatch.next_experiment.proposal import propose
from identification.mismatch.next_experiment.sweeps import Limits
from identification.mismatch.next_experiment.two_levels import two_levels
from identification.mismatch.periodic.periodic_disturbances import Line


def run(
    estimate: Estimate, data: Data, earned: Sequence[Named], lines: Sequence[Line], limits: Limits | None
) -> NextExperiment | None:
    """None where no name and none of the `lines` has a rival that does as well."""
    found = None
    if any(rival.bic_loss < policy.select.RIVALS_EQUAL_BIC for n in earned for rival in n.rivals):
        found = propose(estimate, data, earned, limits)
    if found is not None:
        return found
    undecided = next(
        (x for x in lines if x.rival is not None and x.gain - x.rival.gain < policy.select.RIVALS_EQUAL_BIC), None
    )
    return None if undecided is None else two_levels(undecided, estimate, data, limits or Limits())
