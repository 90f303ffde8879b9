"""One part of the data is fitted, the rest judges: blocks of time kept back, or whole runs that were held out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from identification.mismatch.estimate.estimate import Estimate, forces
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import weights
from identification.mismatch.validate.held_out import Score, blocks, judge_blocks, judge_runs, refitted
from identification.run_history.history import History

WORTH = 6.0
"""By which chi-square must fall on what was not fitted, beside 2 for each parameter."""
SLACK = 1.002
"""RMSE may grow by this where chi-square falls: the loudest noise weighs most in it."""
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


def better(new: Score, old: Score, parameters: int) -> bool:
    """Whether what was not fitted is predicted better by more than chance."""
    return new.chi2 < old.chi2 - (WORTH + 2 * parameters if parameters else 0) and new.rmse < SLACK * old.rmse
