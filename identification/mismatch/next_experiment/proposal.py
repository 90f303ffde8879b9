"""For rivals that the recordings cannot tell: the sweep that separates them best, within the bench's limits.

Candidate pieces (`sweeps`) are foreseen under every rival with its fitted values. What a rival's own parameters, C and
the zero can follow, jointly with the data in hand, does not count. Pieces are taken greedily by what they tell per
second, until the probability that the BIC decides rightly between any two that can be told apart, whichever is true, is
SWEEP_DECIDES or the budget is spent; then pieces that are not needed are left out again.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from identification.mismatch import policy
from identification.mismatch.diagnosis import NextExperiment, PlanStep
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.model.data import Data
from identification.mismatch.name.naming import Named
from identification.mismatch.next_experiment.discrimination import Pieces, distances, needed, pieces, power
from identification.mismatch.next_experiment.predicted_response import (
    Bench,
    PredictedResponse,
    ending,
    one_zero,
    stretches,
)
from identification.mismatch.next_experiment.sweeps import REST, SHORT, Block, Limits, blocks, put_together
from identification.physics.catalogue import traits_of
from identification.recording import Floats

MOST_RIVALS = 4
"""Rivals between which one sweep is designed, the nearest first: pairs grow as their square."""
MOST_SHORTENED = 4
"""Blocks without which a sweep is tried."""
TARGETS = (30.0, 60.0, 120.0, 400.0)
"""Expected chi-square between two rivals that is aimed at: raised while the probability is not SWEEP_DECIDES."""


def _utility(apart: Floats, target: float) -> Floats:
    """(K,) of (K, pairs): the nearest pairs count most; what is far apart already counts no more."""
    out: Floats = np.sum(1 - np.exp(-2.0 * apart / target), axis=1)
    return out


@dataclass(frozen=True, eq=False)
class _Contest:
    """Models that are to be told apart."""

    names: tuple[str, ...]
    fits: tuple[Fit, ...]
    losses: tuple[float, ...]
    """BIC by which each is worse so far."""


def rivals_of(estimate: Estimate, named: Sequence[Named]) -> _Contest | None:
    """The answer and what rivals it, nearest first; None when nothing rivals it."""
    close = sorted(
        ((r.bic_loss, n.term.id, r) for n in named for r in n.rivals),
        key=lambda each: (each[0], each[1], each[2].term.id),
    )[:MOST_RIVALS]
    if not close:
        return None
    own = " with ".join(sorted({of for _, of, _ in close}))
    names = (own, *(r.term.id for _, _, r in close))
    return _Contest(names, (estimate.fit, *(r.fit for _, _, r in close)), (0.0, *(loss for loss, _, _ in close)))


def propose(
    estimate: Estimate, data: Data, named: Sequence[Named], limits: Limits | None = None
) -> NextExperiment | None:
    """The next experiment for an answer with rivals; None when there are none.

    A budget that is shorter than the shortest piece is exceeded by that one.
    """
    contest = rivals_of(estimate, named)
    if contest is None:
        return None
    limits = limits or Limits()
    if data.scale.driver_unit != "V":
        limits = replace(limits, max_voltage=None, slew=None)  # of a bench, in V
    bench = Bench(estimate, data, _slew(data, limits))
    largest = largest_level(data, estimate, limits)
    known = blocks(largest, _flows(data, limits))
    shortest = next(b for b in known if not b.name)
    every = [b for b in known if b.seconds + 2 * REST <= limits.budget] or [shortest]
    tried = _Tried(bench, contest, tuple(every), limits.budget, data)
    return tried.answer()


def largest_level(data: Data, estimate: Estimate, limits: Limits) -> float:
    """The largest driver, in its own unit, that the bench allows and that was recorded before."""
    largest = data.scale.driver if limits.max_voltage is None else min(limits.max_voltage, data.scale.driver)
    C = abs(estimate.fit.theta.C)
    if limits.max_thrust is not None and C > 0:
        largest = min(largest, float(np.sqrt(limits.max_thrust / C)))
    return largest


def _flows(data: Data, limits: Limits) -> tuple[float, ...]:
    """Beside still water: those given, or the largest that was recorded and half of it."""
    if limits.flow_speeds is not None:
        return tuple(sorted({flow for flow in limits.flow_speeds if flow != 0.0}))
    seen = [h.others["flow_speed"] for h in data.histories if "flow_speed" in h.others]
    if not seen or data.scale.flow <= 0:
        return ()
    every = np.concatenate(seen)
    wide = every[np.abs(every) > 0.2 * data.scale.flow]
    return tuple(sorted({round(float(np.quantile(wide, q)), 2) for q in (0.5, 0.95)} - {0.0})) if wide.size else ()


def _slew(data: Data, limits: Limits) -> float:
    if limits.slew is not None:
        return limits.slew
    steepest = 0.0
    for h in data.histories:
        between = 0.5 * (h.dt[1:] + h.dt[:-1])
        steepest = max(steepest, float(np.max(np.abs(np.diff(h.driver)) / between, initial=0.0)))
    return steepest if steepest > 0 else float("inf")


class _Tried:
    """The search: blocks looked at once, sets of them judged together."""

    def __init__(self, bench: Bench, contest: _Contest, every: tuple[Block, ...], budget: float, data: Data) -> None:
        self.bench, self.contest, self.every, self.budget = bench, contest, every, budget
        self.driver_unit = data.scale.driver_unit
        self.recorded = set.intersection(*(set(h.others) for h in data.histories))
        self.parts = _looked_at(bench, contest.fits, every)
        self.seconds = np.array([block.seconds for block in every])
        self.pairs = list(permutations(range(len(contest.fits)), 2))
        even = self._pairwise(self.parts.evenly(budget / float(self.seconds.sum())))[0]
        self.decisive = np.array([0 in pair for pair in self.pairs]) | (even > policy.next_experiment.RIVALS_STAY_ALIKE)

    def answer(self) -> NextExperiment:
        chosen: list[int] = []
        for target in TARGETS:
            chosen = self._grown(chosen, target)
            worst, at = self._judged(chosen)
            if worst >= policy.next_experiment.SWEEP_DECIDES or self._left(chosen) < self.seconds.min():
                break
        if worst >= policy.next_experiment.SWEEP_DECIDES:
            chosen = self._shortened(chosen)
            worst, at = self._judged(chosen)
        held = "command_voltage" if self.driver_unit == "V" else "rotation_rate"
        best = max(at[pair] for pair, counts in zip(self.pairs, self.decisive, strict=True) if counts)
        if best < policy.next_experiment.HOPELESS_POWER:
            return NextExperiment(self._alike(), (), self._expected(at), held)
        return NextExperiment(self._why(chosen, at), self._steps(chosen), self._expected(at), held)

    def _steps(self, chosen: Sequence[int]) -> tuple[PlanStep, ...]:
        return put_together([self.every[k] for k in chosen], self.every)

    def _left(self, chosen: Sequence[int]) -> float:
        """Seconds of the budget, the ways between the levels included."""
        return self.budget - (ending(self._steps(chosen), self.bench.slew)[-1] if chosen else 2 * REST)

    def _grown(self, chosen: Sequence[int], target: float) -> list[int]:
        """With more blocks, each the one that tells most per second, until all pairs are `target` apart."""
        chosen = list(chosen)
        total = self.parts[chosen[0]] if chosen else None
        for k in chosen[1:]:
            assert total is not None
            total = total + self.parts[k]
        while total is None or self._pairwise(total)[:, self.decisive].min() < target:
            now = 0.0 if total is None else float(_utility(self._pairwise(total), target)[0])
            each = self._pairwise(self.parts if total is None else self.parts + total)
            gains = np.where(self.seconds <= self._left(chosen), (_utility(each, target) - now) / self.seconds, -1.0)
            best = int(np.argmax(gains))
            if chosen and (gains[best] <= 0 or gains[best] * self._left(chosen) < policy.next_experiment.SWEEP_GAIN):
                break
            chosen.append(best)
            total = self.parts[best] if total is None else total + self.parts[best]
        return chosen

    def _pairwise(self, total: Pieces) -> Floats:
        """(K, pairs)"""
        apart = distances(total)
        out: Floats = np.column_stack([apart[:, a, b] for a, b in self.pairs])
        return out

    def _judged(self, chosen: Sequence[int]) -> tuple[float, dict[tuple[int, int], float]]:
        """Probability of a right decision of each pair, of the whole sweep as it would be run, and the worst of them.

        Two rivals that are like each other do not count: the sweep may still tell the answer from both.
        """
        views = self._checked_on_held_out(chosen)
        at = {(a, b): power(views[a], views[b], self._needed(a, b, views)) for a, b in self.pairs}
        return min(at[pair] for pair, counts in zip(self.pairs, self.decisive, strict=True) if counts), at

    def _expected(self, at: dict[tuple[int, int], float]) -> float:
        """Probability of a right decision against the worst rival; each model is true as probably as its BIC says."""
        share = np.exp(-0.5 * np.maximum(self.contest.losses, 0.0))
        counted = [pair for pair, counts in zip(self.pairs, self.decisive, strict=True) if counts]
        worst = [min(at[pair] for pair in counted if pair[0] == true) for true in range(share.size)]
        return float(share @ np.array(worst) / share.sum())

    def _checked_on_held_out(self, chosen: Sequence[int]) -> tuple[PredictedResponse, ...]:
        return self.bench.outlook(self.contest.fits, stretches(self._steps(chosen)))[0]

    def _needed(self, true: int, wrong: int, views: Sequence[PredictedResponse]) -> float:
        """Chi-square that the sweep has to add for the wrong model to be RIVALS_EQUAL_BIC worse."""
        n = self.contest.fits[0].residual.size
        sizes = [int(fit.free.sum()) for fit in self.contest.fits]
        loss = self.contest.losses[wrong] - self.contest.losses[true]
        return needed(loss, sizes[wrong] - sizes[true], n, views[0].value.size)

    def _shortened(self, chosen: Sequence[int]) -> list[int]:
        """Without the blocks that are not needed, the longest tried first."""
        chosen = list(chosen)
        for k in sorted(set(chosen), key=lambda k: -self.seconds[k])[:MOST_SHORTENED]:
            rest = list(chosen)
            rest.remove(k)
            if rest and self._judged(rest)[0] >= policy.next_experiment.SWEEP_DECIDES:
                chosen = rest
        return chosen

    def _why(self, chosen: Sequence[int], at: dict[tuple[int, int], float]) -> str:
        names = self.contest.names
        used = [self.every[k] for k in sorted(set(chosen))]
        single = [f"{block.holds[0][0]:g}" for block in used if not block.name]
        unique = [f"levels of +-{', '.join(single)} {self.driver_unit}"] if single else []
        unique += [block.name for block in used if block.name]
        says = f"separates {names[0]} from {', '.join(dict.fromkeys(names[1:]))}: {', '.join(unique)}"
        if self.driver_unit != "V":
            says += f"; the levels are in {self.driver_unit}, the recordings have no command in V"
        return "; ".join([says, *self._beyond(chosen, at)])

    def _alike(self) -> str:
        """The same where nothing that may be driven tells any pair apart."""
        one, *others = dict.fromkeys(self.contest.names)
        told = [f"{other} ({_other_means(one, other, self.recorded)} would tell)" for other in others]
        return f"within these limits {one} is like {' and '.join(told)}"

    def _beyond(self, chosen: Sequence[int], at: dict[tuple[int, int], float]) -> list[str]:
        """What else it takes for the pairs that this sweep hardly tells apart."""
        views = self._checked_on_held_out(chosen)
        apart = distances(pieces(views, np.zeros(views[0].value.size, dtype=np.intp), 1))[0]
        seconds = ending(self._steps(chosen), self.bench.slew)[-1]
        out = []
        for a, b in sorted(
            {(min(pair), max(pair)) for pair, p in at.items() if p < policy.next_experiment.PAIR_HARDLY_TOLD}
        ):
            one, other = self.contest.names[a], self.contest.names[b]
            longer = seconds * policy.next_experiment.PAIR_DECIDED_CHI2 / max(min(apart[a, b], apart[b, a]), 1e-9)
            if longer <= policy.next_experiment.LONGEST_SWEEP * self.budget:
                takes = f"about {max(longer, seconds) / 60:.0f} min of such a sweep"
            else:
                takes = f"no sweep within these limits, but {_other_means(one, other, self.recorded)}"
            out.append(f"to tell {one} from {other} takes {takes}" if a == 0 else f"{one} and {other} stay alike")
        return out


def _looked_at(bench: Bench, fits: Sequence[Fit], every: Sequence[Block]) -> Pieces:
    """Every block, foreseen once: short ones in still water one after the other, the others from rest."""
    short = [k for k, block in enumerate(every) if block.seconds < SHORT and block.flow == 0.0]
    groups = [short, *([k] for k in range(len(every)) if k not in short)]
    runs, ends = [], []
    for group in groups:
        steps = [PlanStep(0.0, REST, every[group[0]].flow)]
        lasts = []
        for k in group:
            steps += [PlanStep(volts, seconds, every[k].flow) for volts, seconds in every[k].holds]
            lasts.append(len(steps) - 1)
        runs.append(steps)
        ends.append(ending(steps, bench.slew)[lasts])
    views, where = bench.outlook(fits, runs)
    block = np.full(where.shape[0], -1)
    for run, (end, group) in enumerate(zip(ends, groups, strict=True)):
        mine = np.flatnonzero((where[:, 0] == run) & (where[:, 1] > REST))
        block[mine] = np.array(group)[np.minimum(np.searchsorted(end, where[mine, 1]), len(group) - 1)]
    return pieces([one_zero(view) for view in views], block, len(every))


def _other_means(one: str, other: str, recorded: Collection[str]) -> str:
    """What else would tell two answers apart, but for channels that were `recorded` already."""
    ids = [effect for name in (one, other) for effect in name.split(" with ")]
    traits = [found for effect in ids if (found := traits_of(effect)) is not None]
    means = [what for each in traits for channel, what in each.told_by if channel not in recorded]
    return ", or ".join(dict.fromkeys(means)) if means else "a quieter cell or larger levels"
