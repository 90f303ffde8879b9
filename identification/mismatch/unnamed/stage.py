"""The stage: names in, the final model out: flexible terms in it where structure is left that no physics carries."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from identification.mismatch import policy
from identification.mismatch.estimate.confidence_intervals import Interval, intervals
from identification.mismatch.estimate.estimate import Estimate, refresh
from identification.mismatch.estimate.fitting import fit
from identification.mismatch.locate.residual_structure_test import ResidualStructure, residual_structure
from identification.mismatch.locate.stage import Located
from identification.mismatch.locate.unrest import told_by_unrest
from identification.mismatch.model.data import Data
from identification.mismatch.name.named_term import Check, restated
from identification.mismatch.name.naming import Named
from identification.mismatch.select.exchange.static_pairs import STATIC
from identification.mismatch.select.forward_selection import Selected, prune
from identification.mismatch.unnamed.confirmed import ASKED, not_standing
from identification.mismatch.unnamed.flexible import Extended, extend
from identification.mismatch.unnamed.flexible_shape import shared
from identification.mismatch.unnamed.shares import mended, mostly_right, nearly_right, scores_alone, with_shares
from identification.mismatch.validate.prediction import WORSE, predicting, predicts
from identification.mismatch.validate.refuted import refuted, without_refuted
from identification.mismatch.validate.stage import Validated
from identification.mismatch.validate.train_test_split import TrainTestSplit
from identification.physics.term import Term
from identification.run_history.history import History

ROUNDS = 3
"""How often names are asked again in the model that is told: one that falls makes it another."""
ALONE = "without terms that have no name it predicts what was not fitted worse than the baseline"


@dataclass(frozen=True, eq=False, slots=True)
class Completed:
    """The final model, and what of it has no name."""

    after: Estimate
    earned: tuple[Named, ...]
    """Those that are mostly right among them. With their values in it, the largest gain first."""
    intervals: Mapping[Term, tuple[Interval, ...]]
    """Of their parameters."""
    unearned: tuple[Named, ...]
    flexible: Extended | None
    """The final model's flexible terms; None where none predicts better what was not fitted."""
    open_ended: bool
    """Whether something is left, or is modelled without a name."""
    bare: Estimate
    """The model without the terms whose names were not earned."""
    left: ResidualStructure
    """What `bare` leaves, where that shows the place better."""
    told: Estimate | None = None
    """The final model with the noise by which its values are told, where that is another."""

    @property
    def stated(self) -> Estimate:
        """The final model by whose values and standard errors it is told."""
        return self.after if self.told is None else self.told

    @property
    def nameless(self) -> tuple[Term, ...]:
        """Terms of the final model that have no name, but for what is of one run's own time."""
        named = {n.term for n in self.earned}
        return tuple(t for t in self.after.fit.model.terms if t not in named and "time" not in t.covariates)


@dataclass(frozen=True, eq=False, slots=True)
class _Without:
    """The model without the terms whose names were not earned, which would hide its place, and what it leaves."""

    bare: Estimate
    left: ResidualStructure
    taken: float = 0.0
    """Chi-square a sample that those terms took, in units of what is left with them."""

    @property
    def nothing(self) -> bool:
        """Whether no more is left than noise leaves: without a place, and no more in size."""
        placeless = self.left.p_value >= policy.locate.RESIDUAL_FALSE_ALARM
        return placeless and self.taken <= policy.unnamed.FOLLOWED_NOISE


@dataclass(frozen=True, eq=False, slots=True)
class _Told:
    """Names, and what they leave."""

    earned: tuple[Named, ...]
    unearned: tuple[Named, ...]
    without: _Without
    gone: tuple[Named, ...] = ()
    """Names that were not earned, whose terms have left the model."""

    @property
    def refused(self) -> tuple[Named, ...]:
        """Names that were not earned."""
        return (*self.gone, *self.unearned)

    @property
    def nameless(self) -> list[Term]:
        """Terms whose names were not earned."""
        return [n.term for n in self.unearned]


def run(
    selected: Selected, located: Located, validated: Validated, unseen: Sequence[History], rng: np.random.Generator
) -> Completed:
    """Flexible terms where they predict better; else the named model, without unnamed terms that predict no better.

    After a search that was interrupted no flexible term is looked for.
    """
    data, now, split = selected.data, located.estimate, validated.split
    told = _Told(validated.earned, validated.unearned, _Without(now, located.left))
    open_ended = (located.structured or bool(told.unearned)) and bool(located.left.groups)
    told = _beyond_chance(told) if open_ended else told
    if open_ended and told.unearned:
        without = _without(now, data, told.unearned, rng)
        if without.nothing and not located.structured:
            return _noise_followed(told.earned, without, now, data)
        told = told if without.nothing else replace(told, without=without)
        while gone := refuted(split, told.unearned, same_run=not unseen):
            now, split = without_refuted(now, gone, data, unseen)
            located = replace(located, estimate=now)
            told = _asked_again(told, gone, now, split, same_run=not unseen)
    return _completed(selected, located, told, split, unseen, rng, open_ended=open_ended)


def _beyond_chance(told: _Told) -> _Told:
    """Where something is left a name for no more than noise makes is none: it follows that."""
    chance = [n for n in told.earned if n.p_value >= policy.unnamed.CHANCE_BESIDE_REST]
    asked = [n.asked(Check("chance", "it is more than noise makes", f"by chance (p {n.p_value:.2g})")) for n in chance]
    return replace(told, earned=tuple(n for n in told.earned if n not in chance), unearned=(*told.unearned, *asked))


def _asked_again(
    told: _Told, gone: tuple[Named, ...], now: Estimate, split: TrainTestSplit, *, same_run: bool
) -> _Told:
    """Without the terms that have `gone`: a name that was earned beside them must predict without them too."""
    earned = tuple(restated(told.earned, now.fit))
    worse = refuted(split, earned, same_run=same_run)
    left = (*(n for n in told.unearned if n not in gone), *(n.asked(Check("predicts", ASKED, WORSE)) for n in worse))
    return _Told(tuple(n for n in earned if n not in worse), left, told.without, (*told.gone, *gone))


def _completed(
    selected: Selected,
    located: Located,
    told: _Told,
    split: TrainTestSplit,
    unseen: Sequence[History],
    rng: np.random.Generator,
    *,
    open_ended: bool,
) -> Completed:
    """With free shapes of what is left, or by its names alone."""
    flexible = None
    if open_ended and not selected.undone:
        told, flexible = _shaped(selected, located, told, split, rng)
    if flexible is None:
        return _by_names(selected, located, told, split, unseen, rng, open_ended=open_ended)
    now, data = located.estimate, selected.data
    earned = with_shares(split, told.earned, told.nameless, flexible.held, same_run=not unseen)
    valued, known = _with_values(earned, now, flexible.estimate, data, flexible)
    bare, left = told.without.bare, told.without.left
    return Completed(flexible.estimate, valued, known, told.refused, flexible, open_ended, bare, left)


def _noise_followed(earned: Sequence[Named], without: _Without, now: Estimate, data: Data) -> Completed:
    """It was noise that the terms without a name followed: they go, and with them names that were worth something
    beside them alone (a lag of the water, its share 0 beside the lag and the delay that were left)."""
    after = prune(refresh(without.bare.fit.model, without.bare.fit.theta, data, None, now), data)
    earned = [n for n in earned if n.term in after.fit.values]
    told = told_by_unrest(after, data)
    return Completed(after, *_with_values(earned, now, told, data, None), (), None, False, after, without.left, told)


def _shaped(
    selected: Selected, located: Located, told: _Told, split: TrainTestSplit, rng: np.random.Generator
) -> tuple[_Told, Extended | None]:
    """Free shapes of what is left, and the names that stand beside them; no shapes where none predicts better."""
    data, now = selected.data, located.estimate
    over = foremost_covariate(told.without.left, told.unearned, data)
    again = partial(extend, now, selected.before, data, over, split=split, rng=rng)
    flexible = again(told.unearned)
    best = min(split.judge(split.estimate.fit).rmse, np.inf if flexible is None else flexible.held)
    mostly = mostly_right(split, told.unearned if located.structured else nearly_right(told.unearned), best)
    if mostly.right:  # back: a free shape is for what they leave
        unearned = tuple(n for n in told.unearned if n not in mostly.right)
        without = _without(now, data, unearned, rng)
        told = _Told((*told.earned, *mostly.right), unearned, told.without if without.nothing else without, told.gone)
        flexible = again(unearned)
    if flexible is None or not told.unearned:
        return told, flexible
    earned, unearned, flexible = _standing(told.earned, told.unearned, flexible, now, split, data, again)
    return replace(told, earned=earned, unearned=unearned), flexible


def _by_names(
    selected: Selected,
    located: Located,
    told: _Told,
    split: TrainTestSplit,
    unseen: Sequence[History],
    rng: np.random.Generator,
    *,
    open_ended: bool,
) -> Completed:
    """The model of the names; that of the baseline where it predicts worse without the terms that have none."""
    data, before, now = selected.data, selected.before, located.estimate
    after = predicting(now, split, data, selected.terms, told.nameless, unseen)
    if told.earned and told.refused and not predicts(after, before, data, unseen):
        worse = Check("predicts", "predicts better than the baseline", ALONE)
        unearned = (*told.unearned, *(n.asked(worse) for n in told.earned))
        without = _without(now, data, unearned, rng)
        told = _Told((), unearned, _Without(now, located.left) if without.nothing else without, told.gone)
        after = before
    held = split.judge(split.estimate.fit).rmse
    earned = with_shares(split, told.earned, told.nameless, held, same_run=not unseen)
    stated = after if open_ended else told_by_unrest(after, data)
    valued, known = _with_values(earned, now, stated, data, None, told.nameless)
    bare, left = told.without.bare, told.without.left
    return Completed(after, valued, known, told.refused, None, open_ended, bare, left, stated)


def _without(after: Estimate, data: Data, unearned: Sequence[Named], rng: np.random.Generator) -> _Without:
    bare = replace(after, fit=fit(*after.fit.less(*(n.term for n in unearned)), data, after.weights))
    taken = bare.fit.chi2 / after.fit.chi2 - 1.0
    return _Without(bare, residual_structure(bare.fit, data, after.weights, rng), taken)


def _standing(
    earned: tuple[Named, ...],
    unearned: tuple[Named, ...],
    flexible: Extended,
    now: Estimate,
    split: TrainTestSplit,
    data: Data,
    again: Callable[[Sequence[Named]], Extended | None],
) -> tuple[tuple[Named, ...], tuple[Named, ...], Extended]:
    """Names that stand where they are told, all others, and the free shapes beside them: back, as a name may only mend
    a term that has none. One that falls stays in the model without a name where no shape does as well in its place.

    `again`: shapes in the place of all that has no name.
    """
    for _ in range(ROUNDS):
        told, _known = _with_values(earned, now, flexible.estimate, data, flexible)
        fallen = not_standing(earned, told, data.scale, scores_alone(split, earned, [n.term for n in unearned]))
        if not fallen:
            break
        unearned = (*unearned, *(n.asked(fallen[n.term]) for n in earned if n.term in fallen))
        earned = tuple(n for n in earned if n.term not in fallen)
        other = again(unearned)
        if other is not None and other.held <= flexible.held:
            flexible = other
    return earned, unearned, flexible


def foremost_covariate(left: ResidualStructure, unearned: Sequence[Named], data: Data) -> str:
    """The covariate over which it is left most clearly; a static curve is one over what drives."""
    if (
        left.p_value >= policy.locate.RESIDUAL_FALSE_ALARM
    ):  # nothing beyond noise is left: the doubt itself is the place
        driver = data.histories[0].driver_quantity
        own = {driver if c in STATIC else c for n in unearned for c in n.term.covariates}
        return next((g for g in left.groups if g.covariate.quantity in own), left.groups[0]).covariate.quantity
    return left.groups[0].covariate.quantity


def _with_values(
    earned: Sequence[Named],
    before: Estimate,
    after: Estimate,
    data: Data,
    free: Extended | None,
    unnamed: Sequence[Term] = (),
) -> tuple[tuple[Named, ...], dict[Term, tuple[Interval, ...]]]:
    """Names with their values and intervals in the final model, `after`. Of those that share a covariate with a
    flexible term in the model without any; of those that a term without a name mends, in the model without it."""
    if free is not None:
        alone, dropped = shared([n.term for n in earned], free), free.dropped
    else:
        alone, dropped = [n.term for n in earned if mended(n) and unnamed], tuple(unnamed)
    named = restated([n for n in earned if n.term not in alone], after.fit)
    known = intervals(after.fit, data, after.weights, [n.term for n in named])
    if alone:
        bare = refresh(*before.fit.less(*dropped), data, None, None)  # what it leaves is noise to it
        named += restated([n for n in earned if n.term in alone], bare.fit)
        known |= intervals(bare.fit, data, bare.weights, alone)
    return tuple(sorted(named, key=lambda n: -n.chi2_gain)), known
