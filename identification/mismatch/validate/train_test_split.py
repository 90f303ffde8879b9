"""One part of the data is fitted, the rest judges: blocks of time kept back, or whole runs that were held out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identification.mismatch import policy
from identification.mismatch.estimate.clock_hollows import with_clocks_of
from identification.mismatch.estimate.estimate import Estimate, forces
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import weights
from identification.mismatch.validate.held_out import (
    Score,
    blocks,
    held_out_price,
    judge_blocks,
    judge_runs,
    refitted,
)
from identification.physics.term import Term
from identification.run_history.history import History

Judge = Callable[[Fit], Score]


@dataclass(frozen=True, eq=False, slots=True)
class TrainTestSplit:
    """A model fitted to one part of the data, and what judges it on the rest."""

    data: Data
    """What is fitted."""
    judge: Judge
    estimate: Estimate
    """The model fitted to that."""


def train_test_split(after: Estimate, data: Data, others: Sequence[History]) -> TrainTestSplit:
    """All of it is fitted where `others`, whole runs, are there to judge on; otherwise blocks of time are kept back."""
    if others:
        return TrainTestSplit(data, judge_runs(after, data, others), after)
    keep = [blocks(h) for h in data.histories]
    part = replace(data, keep=tuple(keep))
    begin = refitted(after, data, keep)
    w = weights(part, after.noise, forces(begin.model, begin.theta, part), after.rate_noise)
    estimate = Estimate(begin, after.noise, after.rate_noise, w, part.thrust_rows)
    return TrainTestSplit(part, judge_blocks(estimate, data, keep), estimate)


def refitted_without(split: TrainTestSplit, term: Term) -> Fit:
    """The model without one of its terms, fitted to the same part; once for all who ask."""
    now, data = split.estimate.fit, split.data

    def made() -> Fit:
        smaller = fit(*now.less(term), data, split.estimate.weights)
        return with_clocks_of(now.theta, smaller, data, split.estimate.weights)

    found: Fit = data.predictor.once(("refitted without", term), made, split.estimate, data)
    return found


def better(new: Score, old: Score, parameters: int) -> bool:
    """Whether what was not fitted is predicted better by more than chance."""
    return (
        new.chi2 < old.chi2 - (held_out_price(parameters) if parameters else 0)
        and new.rmse < policy.validate.HELD_OUT_RMSE_SLACK * old.rmse
    )
