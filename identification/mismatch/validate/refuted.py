"""Terms without a name that are none of the rotor's by its measured rate, or that predict what was not fitted worse:
they leave the model before any shape is looked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.model.data import Data
from identification.mismatch.name.naming import Named
from identification.mismatch.validate.prediction import without_each, worse_predicted
from identification.mismatch.validate.train_test_split import TrainTestSplit, refitted_without, train_test_split
from identification.run_history.history import History


def refuted(split: TrainTestSplit, unearned: Sequence[Named], *, same_run: bool) -> tuple[Named, ...]:
    """Of terms without a name those that the measured rate contradicts, which bend C whatever they predict; then those
    without which what was not fitted is predicted better, one after the other: the one whose absence takes most off
    chi-square there first, the rest fitted again each time.

    `split`: the model fitted to a part of the data; `same_run` as in `without_each`.
    """
    gone = [n for n in unearned if any(check.failed and check.kind == "rate_levels" for check in n.checks)]
    for each in gone:
        split = replace(split, estimate=replace(split.estimate, fit=refitted_without(split, each.term)))
    while left := [n for n in unearned if n not in gone]:
        scores = without_each(split, [n.term for n in left], same_run=same_run)
        worse = worse_predicted(scores, same_run=same_run)
        if not worse:
            break
        most = min(worse, key=lambda term: scores.less[term].chi2)
        gone.append(next(n for n in left if n.term == most))
        split = replace(split, estimate=replace(split.estimate, fit=refitted_without(split, most)))
    return tuple(gone)


def without_refuted(
    now: Estimate, gone: Sequence[Named], data: Data, unseen: Sequence[History]
) -> tuple[Estimate, TrainTestSplit]:
    """The model without them, its noise estimated anew, and that fitted to a part of the data."""
    less = refresh(*now.fit.less(*(n.term for n in gone)), data, None, now)
    return less, train_test_split(less, data, unseen)
