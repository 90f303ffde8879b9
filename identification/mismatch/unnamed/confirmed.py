"""Names that were earned beside terms without one, asked again where they are told: beside a free shape in their place.

A term fitted beside another that is no physics may mend it: with that one gone its value is another, or none that it
can have, and what was not fitted is predicted better without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import out_of_the_question
from identification.mismatch.name.named_term import Check
from identification.mismatch.name.naming import Named
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.prediction import WORSE
from identification.physics.term import Scale, Term

ASKED = "the same without the terms that have no name"
BOUND = "without the other terms that were refused it would take values that are not possible"
OTHER = "without the other terms that were refused its value is another"


def not_standing(
    asked: Sequence[Named], told: Sequence[Named], scale: Scale, scores: tuple[Score, Mapping[Term, Score]]
) -> dict[Term, Check]:
    """Of names those that do not stand where they are told, with the check that they fail.

    `asked`: with the values at which they were earned; `told`: the same with those of the model that is told;
    `scores`: of the names alone on what was not fitted, and without each of them.
    """
    whole, less = scores
    earned_at = {n.term: n for n in asked}
    out = {}
    for name in told:
        was, without = earned_at[name.term], less[name.term]
        if out_of_the_question(name.term, name.theta, scale):
            out[name.term] = Check("possible", ASKED, BOUND)
        elif _moved(was, name, scale):
            out[name.term] = Check("constant", ASKED, OTHER, apart=1.0)
        elif without.chi2 < whole.chi2 - policy.validate.PREDICTED_WORSE_CHI2 and without.rmse < whole.rmse:
            out[name.term] = Check("predicts", ASKED, WORSE)
    return out


def _moved(was: Named, now: Named, scale: Scale) -> bool:
    """Whether the amount is another, beyond its errors and by more than a share of the larger one."""
    neutral = was.term.parameters(scale)[0].neutral or 0.0
    one, other = was.theta[0] - neutral, now.theta[0] - neutral
    error = float(np.hypot(*np.nan_to_num([was.std[0], now.std[0]])))
    apart = abs(one - other)
    return apart > max(policy.unnamed.TOLD_APART * max(abs(one), abs(other)), policy.unnamed.TOLD_SIGMA * error)
