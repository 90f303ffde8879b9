"""How much each effect is of what anything could explain, judged on what was not fitted; which names are mostly right.

A textbook's shape never fits a real recording whole: something stays over its own covariate, or its parameter is not
quite the same everywhere. Where a name by itself makes most of the improvement that any shape could make, it is said,
with what is left beside it; a free shape is for what is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identification.mismatch import policy
from identification.mismatch.estimate.at_bounds import at_bound
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.name.named_term import GRAVE, Attained
from identification.mismatch.name.naming import Named
from identification.mismatch.validate.held_out import Score, held_out_price
from identification.mismatch.validate.train_test_split import TrainTestSplit, better, refitted_without
from identification.physics.term import Term


@dataclass(frozen=True, eq=False, slots=True)
class Mostly:
    """Names that are mostly right, and those that are not."""

    right: tuple[Named, ...]
    others: tuple[Named, ...]


def mostly_right(split: TrainTestSplit, unearned: Sequence[Named], best: float) -> Mostly:
    """Of the names that were not earned the fewest that together make most of what any shape could.

    The one that predicts best goes first; a further one is asked for most of what those before leave.
    `split`: the whole model fitted to a part of the data, and what judges it on the rest; `best`: RMSE in N there of
    what predicts best, free shapes and all.
    """
    now = _fitted(split, split.estimate.fit, [n.term for n in unearned])
    before = score = split.judge(now)
    left = [n for n in unearned if _possible(n)]
    right: list[Named] = []
    tried: list[Named] = []
    while left:
        fits = [(n, one) for n in left if (one := _with(split, now, n)) is not None]
        if not fits:
            break
        most, now = min(fits, key=lambda each: split.judge(each[1]).rmse)
        new = split.judge(now)
        if not better(new, score, len(most.theta)):
            break
        tried.append(most)
        left = [n for n in left if n is not most and not (repairs(n) and repairs(most))]
        score = new
        if share(before, score, min(best, score.rmse)) >= policy.unnamed.MOSTLY_SHARE:
            right, before = [*right, *tried], score
            tried = []
    told = needed(split, right, unearned)
    return Mostly(told, tuple(n for n in unearned if n not in told))


def needed(split: TrainTestSplit, right: Sequence[Named], unearned: Sequence[Named]) -> tuple[Named, ...]:
    """Of names that together make most of it those that take something off beside the others: one that was the best by
    itself may do nothing beside those that came after it.

    `split`: the whole model fitted to a part of the data, of which the rest of `unearned` is taken out.
    """
    kept = list(right)
    while kept:
        score, without = scores_alone(split, kept, [n.term for n in unearned if n not in kept])
        idle = [n for n in kept if without[n.term].rmse <= score.rmse]
        if not idle:
            break
        kept.remove(min(idle, key=lambda n: without[n.term].rmse))
    return tuple(kept)


def with_shares(
    split: TrainTestSplit, named: Sequence[Named], others: Sequence[Term], best: float, *, same_run: bool
) -> tuple[Named, ...]:
    """The names with their shares: beside each other, without the terms `others`, which have no name. Those that
    another run need not repeat have none there, nor have those that slow noise hides.

    `best`: RMSE in N of the model that predicts best, free shapes and all; `same_run`: what was not fitted is blocks of
    time of the runs that were.
    """
    if not named:
        return ()
    score, without = scores_alone(split, named, others)
    least = min(best, score.rmse)

    def shared(n: Named) -> Named:
        less = without[n.term]
        return replace(n, attained=Attained(less.rmse, score.rmse, share(less, score, least)))

    def judged(n: Named) -> bool:
        return (same_run or not n.term.traits.own_clock) and not _behind_slow_noise(without[n.term], score, n)

    return tuple(shared(n) if judged(n) else n for n in named)


def _behind_slow_noise(without: Score, with_it: Score, named: Named) -> bool:
    """Whether it takes nothing off the error, and yet off what is left of it with slow noise taken out."""
    fall = without.chi2 - with_it.chi2
    return with_it.rmse >= without.rmse and fall > held_out_price(len(named.theta))


def scores_alone(
    split: TrainTestSplit, named: Sequence[Named], others: Sequence[Term]
) -> tuple[Score, dict[Term, Score]]:
    """On what was not fitted, of the model without the terms `others`, and of it without each of these names too."""
    now = _fitted(split, split.estimate.fit, others)
    return split.judge(now), {n.term: split.judge(_fitted(split, now, [n.term])) for n in named}


def share(without: Score, with_it: Score, least: float) -> float:
    """Of the squared error that could be taken off, down to `least` N, how much is (0 to 1).

    >>> round(share(Score(2.0, 0.0), Score(1.2, 0.0), 1.0), 3)
    0.853
    """
    could = without.rmse**2 - least**2
    return min(max((without.rmse**2 - with_it.rmse**2) / could, 0.0), 1.0) if could > 0 else 0.0


def only_repairs(unearned: Sequence[Named]) -> tuple[Named, ...]:
    """Names that failed nothing but that another shape on the same curve explains nearly the same."""
    return tuple(n for n in unearned if all(c.kind == "repair" for c in n.checks if c.failed))


def nearly_right(unearned: Sequence[Named]) -> tuple[Named, ...]:
    """Names that failed nothing but that with others on the same curve they make any, or that a parameter is not quite
    the same everywhere: what one of them makes of it by itself can still be said."""
    return tuple(n for n in unearned if all(c.kind in ("any_curve", "constant") for c in n.checks if c.failed))


def repairs(named: Named) -> bool:
    """Whether another shape on the same curve explains nearly the same."""
    return any(check.kind == "repair" for check in named.checks if check.failed)


def mended(named: Named) -> bool:
    """Whether other shapes on the same curve mend it: its value means something without them alone."""
    return any(check.kind in ("repair", "any_curve") for check in named.checks if check.failed)


def _possible(named: Named) -> bool:
    """Whether it failed no more than its shape: values that it can have, and parts that are not too far apart."""
    failed = [check for check in named.checks if check.failed]
    return all(c.kind not in GRAVE and c.apart <= policy.unnamed.MOSTLY_APART for c in failed)


def _fitted(split: TrainTestSplit, now: Fit, without: Sequence[Term]) -> Fit:
    there = [t for t in without if t in now.model.terms]
    if now is split.estimate.fit and len(there) == 1:
        return refitted_without(split, there[0])
    return fit(*now.less(*there), split.data, split.estimate.weights) if there else now


def _with(split: TrainTestSplit, now: Fit, named: Named) -> Fit | None:
    """The model with that term as well; None where its values are none that it can have."""
    new = fit(*now.more(named.term, named.theta), split.data, split.estimate.weights)
    return None if at_bound(named.term, new, split.data, split.estimate.weights) else new
