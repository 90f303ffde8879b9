"""A force that comes before its command: by how much, as a first search has it.

Intervals are short after a step, where a rotor and the water move, and long before the next one, where nothing does.
Of a log whose command is stamped late (a simulation by steps as long as its rows, of which each shows what its own
command has done) the rotor moves before the step: on long intervals a delay and a lag could not follow it, and what
they missed was told as a loss at reversals, or as a lag of the water.
"""

from __future__ import annotations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.model.sub_interval import delay_of
from identification.mismatch.select.forward_selection import Selected


def early_of(found: Selected) -> float:
    """S by which the force comes before the steps of its command, by the model that was found; 0: it does not, or by
    so little that the intervals need not be others."""
    runs = [each for each in found.data.histories if each.ticks is not None]
    if not runs:
        return 0.0
    fitted = found.after.fit
    early = -(delay_of(fitted.model, fitted.theta) + fitted.theta.shift)
    spacing = min(float(np.median(np.diff(each.sample_time))) for each in runs)
    return early if early > policy.select.EARLY_FORCE * spacing else 0.0
