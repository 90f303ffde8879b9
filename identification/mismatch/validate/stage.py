"""The stage: a model and its names in, what judges it on what was not fitted out, and the names that fail there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identification.mismatch.diagnosis import HeldOutRmse
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.model.data import Data
from identification.mismatch.name.named_term import Check
from identification.mismatch.name.naming import Named
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.validate.cross_validation import by_folds
from identification.mismatch.validate.held_out import by_blocks, by_runs
from identification.mismatch.validate.prediction import (
    UNPROVEN,
    WORSE,
    WithoutEach,
    unproven_changes,
    without_each,
    worse_predicted,
)
from identification.mismatch.validate.train_test_split import TrainTestSplit, train_test_split
from identification.physics.term import Term
from identification.run_history.history import History


@dataclass(frozen=True, eq=False, slots=True)
class Validated:
    """The names after their last check."""

    split: TrainTestSplit
    """The model fitted to a part of the data, and what judges it on the rest."""
    scores: WithoutEach
    """Of the model there, and of it without each term whose name stood so far."""
    earned: tuple[Named, ...]
    unearned: tuple[Named, ...]
    """Each with the checks that it failed."""


def run(estimate: Estimate, named: Sequence[Named], data: Data, unseen: Sequence[History]) -> Validated:
    """`unseen`: whole runs held out; where there are none blocks of time are kept back."""
    split = train_test_split(estimate, data, unseen)
    asked = [n.term for n in named if not n.failed_checks]
    scores = without_each(split, asked, same_run=not unseen)
    worse = worse_predicted(scores, same_run=not unseen)
    failed = dict.fromkeys(unproven_changes(estimate.fit.model, scores), UNPROVEN) | dict.fromkeys(worse, WORSE)
    checked = [n.asked(_check(n, scores, failed.get(n.term, ""))) for n in named]
    earned = tuple(n for n in checked if not n.failed_checks)
    return Validated(split, scores, earned, tuple(n for n in checked if n.failed_checks))


def _check(named: Named, scores: WithoutEach, failed: str) -> Check:
    """On what was not fitted."""
    asked = "predicts what was not fitted"
    score = scores.less.get(named.term)
    if score is None:
        told = "not asked: it failed before" if named.failed_checks else "not asked: another run need not repeat it"
        return Check("predicts", asked, told=told, silent=True)
    return Check("predicts", asked, failed, f"chi-square {score.chi2 - scores.whole.chi2:+.4g} without it")


def score(
    before: Estimate,
    after: Estimate,
    data: Data,
    measured: Data,
    unseen: Sequence[History],
    quiet: Noise,
    *,
    flexible: bool,
) -> HeldOutRmse:
    """Errors on the runs held out; where none are on each run in turn; on blocks of time where one run is all there is,
    and where flexible terms were chosen on the rest of these.

    `measured`: the runs with periodic disturbances still in them. `quiet`: noise of another model of these runs.
    On other runs it is that without what is of one run's own time, where that is smaller: they need not repeat it.
    """

    def judged(leaving: Sequence[Term] = ()) -> HeldOutRmse:
        if unseen:
            return by_runs(before, after, data, unseen, quiet, leaving)
        return by_folds(before, after, data, measured, quiet, leaving)

    if flexible and not unseen:
        return by_blocks(before, after, data, measured, quiet)
    found = judged()
    own = [t for t in after.fit.model.terms if t.traits.own_clock and not t.traits.delay]
    if not own:
        return found
    without = judged(own)
    told = f"{without.what}; of one run's own time, and left out there: {', '.join(t.id for t in own)}"
    return replace(without, what=told) if without.after < found.after else found
