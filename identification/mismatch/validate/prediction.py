"""What was not fitted: a name must predict it, and what has no name stays in the model only where it does."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.clock_hollows import with_clocks_of
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.model import Model
from identification.mismatch.select.baseline import baseline
from identification.mismatch.validate.held_out import Score
from identification.mismatch.validate.train_test_split import TrainTestSplit, better, refitted_without, train_test_split
from identification.physics.term import Term
from identification.run_history.history import History

WORSE = "what was not fitted is predicted better without it"
UNPROVEN = "what was not fitted is predicted as well with the baseline's amount"


@dataclass(frozen=True, eq=False, slots=True)
class WithoutEach:
    """Scores on what was not fitted."""

    whole: Score
    """Of the model."""
    less: Mapping[Term, Score]
    """Of the model without a term, refitted."""


def without_each(split: TrainTestSplit, terms: Collection[Term], *, same_run: bool) -> WithoutEach:
    """The model, and it without each of these terms; without none that another run need not repeat.

    `same_run`: what was not fitted is blocks of time of the runs that were.
    """
    estimate, now = split.estimate, split.judge(split.estimate.fit)
    asked = [t for t in estimate.fit.model.terms if t in terms and (same_run or not t.traits.own_clock)]
    return WithoutEach(now, {t: split.judge(refitted_without(split, t)) for t in asked})


def worse_predicted(scores: WithoutEach, *, same_run: bool) -> tuple[Term, ...]:
    """Of these terms those without which the model predicts what was not fitted better.

    `same_run` as in `without_each`. The noise of other runs may be another, which is why their errors must fall as
    well.
    """
    now, most = scores.whole, np.inf if same_run else scores.whole.rmse
    return tuple(
        t
        for t, score in scores.less.items()
        if score.chi2 < now.chi2 - policy.validate.PREDICTED_WORSE_CHI2 and score.rmse < most
    )


def unproven_changes(model: Model, scores: WithoutEach) -> tuple[Term, ...]:
    """Of these terms of a model those that change what its baseline has, and are worth too little on what was not
    fitted."""
    least = scores.whole.chi2 + policy.validate.CHANGE_WORTH_CHI2
    return tuple(t for t, score in scores.less.items() if model.given_for(t) is not None and score.chi2 < least)


def predicting(
    after: Estimate,
    split: TrainTestSplit,
    data: Data,
    terms: Sequence[Term],
    unearned: Collection[Term],
    others: Sequence[History],
) -> Estimate:
    """The model, without the terms whose name was not earned where these make the prediction no better.

    Both are fitted to a part of the data and judged on the rest; with `others`, on those runs. `terms`: whose shapes
    are taken out of the noise of the smaller one, as before any was found. `split`: `after`, so fitted.
    """
    if not unearned:
        return after
    smaller, theta = after.fit.less(*unearned)
    bare = baseline(data, theta, terms, smaller)
    smaller_fit = train_test_split(bare, data, others).estimate.fit
    return after if better(split.judge(split.estimate.fit), split.judge(smaller_fit), 0) else bare


def predicts(estimate: Estimate, before: Estimate, data: Data, others: Sequence[History]) -> bool:
    """Whether the model predicts what was not fitted better than the baseline, `before`."""
    split = train_test_split(estimate, data, others)
    found = fit(before.fit.model, before.fit.theta, split.data, split.estimate.weights)
    plain = with_clocks_of(split.estimate.fit.theta, found, split.data, split.estimate.weights)
    return split.judge(split.estimate.fit).rmse < split.judge(plain).rmse
