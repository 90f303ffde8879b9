"""From scores to the figures of the proof, beside their goals. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from rig.blind.design import LADDER, ORACLE, PAIR_STRENGTH, STRENGTHS, WITHIN
from rig.blind.scoring.composites import composite_besides, difference_goals, field_goals
from rig.blind.scoring.on_benches import bench_besides, bench_goals
from rig.blind.scoring.rates import Goal, Rate, of_groups, of_rate, rate
from rig.blind.scoring.score import LOCATED, OPEN_CELLS, Score
from rig.blind.scoring.wired import wired_besides, wired_goals

LARGE: Final = 9.9
MODELLED: Final = (*STRENGTHS, "pair", "form", "variant")
"""Cells whose models have another run to predict, by the whole catalogue."""
SEEN: Final = 3.0
"""sigma that a neighbour leaves: nearly all such an oracle would still tell."""


def cell(scores: Iterable[Score], *names: str) -> list[Score]:
    """The scores of the cells of these names, in their order."""
    return [s for s in scores if s.order.cell in names]


def by_label(scores: Iterable[Score], *names: str) -> dict[str, list[Score]]:
    """Those of the cells `names`, effect by effect."""
    found: dict[str, list[Score]] = {}
    for s in cell(scores, *names):
        found.setdefault(s.order.label, []).append(s)
    return dict(sorted(found.items()))


def goals(scores: Sequence[Score]) -> list[Goal]:
    """The goals of the proof, in its order."""
    alone, counted = cell(scores, *STRENGTHS), [s for s in cell(scores, *OPEN_CELLS) if s.counted]
    clear, plain = cell(scores, "clear"), cell(scores, "plain")
    pairs, variants = cell(scores, "pair"), cell(scores, "variant")
    found = [
        of_rate("faint: right or among stated rivals", rate(s.right for s in cell(scores, "faint")), least=0.92),
        of_rate("clear: right or among stated rivals", rate(s.right for s in clear), least=0.97),
        of_rate("clear: right alone", rate(s.alone for s in clear), least=0.90),
        of_rate("plain: right or among stated rivals", rate(s.right for s in plain), least=0.99),
        of_rate("plain: right alone", rate(s.alone for s in plain), least=0.95),
        of_rate("wrong names, one effect", rate(s.wrong for s in alone), most=0.01),
        of_rate(
            f"pairs at {PAIR_STRENGTH:g}: both right or among stated rivals", rate(s.right for s in pairs), least=0.92
        ),
        of_rate(
            "other textbook forms at plain: right or among stated rivals", rate(s.right for s in variants), least=0.90
        ),
        of_rate("open world: unexplained, right place", rate(s.outcome in LOCATED for s in counted), least=0.90),
        of_rate("open world: a wrong name instead", rate(s.outcome == "wrong name" for s in counted), most=0.05),
    ]
    found += [*_alarms(scores), *_errors(scores), *_coverage(scores), *_power(scores)]
    found += [*bench_goals(cell(scores, "bench")), *wired_goals(cell(scores, "wiring"))]
    return [*found, *field_goals(cell(scores, "field")), *difference_goals(cell(scores, "difference"))]


def besides(scores: Sequence[Score]) -> list[Goal]:
    """Figures without a goal of their own that a reader needs to weigh the goals."""
    named = [
        of_rate(f"{name}: {what}", rate(of(s) for s in cell(scores, name)))
        for name in STRENGTHS
        for what, of in (("among stated rivals only", _rival_only), ("a name that is not there", _extra))
    ]
    pairs, opened = cell(scores, "pair"), cell(scores, *OPEN_CELLS)
    counted = [s for s in opened if s.counted]
    plain = cell(scores, "plain")
    sure = [s for s in plain if not s.counted and s.said == "explained"]
    return [
        *named,
        of_rate("faint: right alone", rate(s.alone for s in cell(scores, "faint"))),
        of_rate(
            "plain: right alone, where the nearest neighbour leaves an oracle 8 sigma",
            rate(s.alone for s in plain if s.counted),
        ),
        of_rate("plain: right alone, where it leaves less and no doubt is stated", rate(s.alone for s in sure)),
        of_rate("pairs: both named", rate(set(s.truth) <= set(s.named) for s in pairs)),
        of_rate("pairs: right alone", rate(s.alone for s in pairs)),
        of_rate("other textbook forms at plain: right alone", rate(s.alone for s in cell(scores, "variant"))),
        of_rate("textbook forms of the catalogue at plain: right", rate(s.right for s in cell(scores, "form"))),
        of_rate("channels that lie: said", rate(s.right for s in cell(scores, "fault"))),
        of_rate("wrong names, one effect below faint", rate(s.wrong for s in cell(scores, *LADDER))),
        *(
            of_rate(f"open world, {name}: unexplained, right place", rate(s.outcome in LOCATED for s in group))
            for name in OPEN_CELLS
            for group in ([s for s in counted if s.order.cell == name],)
        ),
        of_rate(
            f"open world, {SEEN:g} sigma left or more: unexplained, right place",
            rate(s.outcome in LOCATED for s in opened if s.leaves(SEEN)),
        ),
        of_rate("open world: any name, beside unexplained or instead", rate(bool(s.named) for s in counted)),
        of_rate("models that predict another run", rate(s.held_out is not None for s in cell(scores, *MODELLED))),
        of_rate("crashed, refused or overdue", rate(s.failed for s in scores)),
        *bench_besides(cell(scores, "bench")),
        *composite_besides(cell(scores, "field"), cell(scores, "difference")),
        *wired_besides(cell(scores, "wiring")),
    ]


def _rival_only(s: Score) -> bool:
    return s.rival_only


def _extra(s: Score) -> bool:
    return s.extra


def _alarms(scores: Sequence[Score]) -> list[Goal]:
    """Of the plain kinds of noise and, where they were asked for, of the wide ones."""
    wide = cell(scores, "wide")
    found = _alarms_of(cell(scores, "clean"), "clean recordings", 0.003)
    return found + (_alarms_of(wide, "clean recordings with wide noise", 0.0) if wide else [])


def _alarms_of(clean: Sequence[Score], what: str, least: float) -> list[Goal]:
    kinds = dict.fromkeys(s.order.label for s in clean)
    return [
        of_rate(f"false alarms, {what}", rate(not s.right for s in clean), least, 0.02),
        *(
            of_rate(f"false alarms, {kind} noise", rate(not s.right for s in clean if s.order.label == kind), most=0.03)
            for kind in kinds
        ),
    ]


def ratios(scores: Iterable[Score], of: Callable[[Any], float]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Held-out figures of the runs with one effect or two, by the whole catalogue."""
    kept = (s for s in cell(scores, *MODELLED) if s.held_out is not None)
    return np.array([of(s.held_out) for s in kept])


def _errors(scores: Sequence[Score]) -> list[Goal]:
    model = ratios(scores, lambda h: h.model)
    found = []
    for what, share, most in (("median", 0.5, 1.05), ("95 % of runs", 0.95, 1.3)):
        value = float(np.quantile(model, share)) if model.size else float("nan")
        name = f"held-out error over that of the true model, {what}"
        found.append(Goal(name, 0.0, most, value, value, value, model.size, percent=False))
    return found


def _coverage(scores: Sequence[Score]) -> list[Goal]:
    covers = ([i.covers for i in s.intervals] for s in cell(scores, *STRENGTHS))
    return [of_groups("coverage of the 95 % intervals of effects' parameters", covers, 0.93, 0.97)]


def _power(scores: Sequence[Score]) -> list[Goal]:
    found = [d for _, d in half_named(scores)]
    within = rate(d <= WITHIN * ORACLE for d in found)
    return [of_rate(f"effects named in half the runs at {WITHIN:g} times the oracle's strength", within, least=1.0)]


def named_by_strength(scores: Iterable[Score]) -> dict[str, dict[float, Rate]]:
    """Effect -> strength -> rate of runs in which it is among findings and rivals."""
    strengths = {**LADDER, **STRENGTHS}
    found: dict[str, dict[float, list[bool]]] = {}
    for s in cell(scores, *strengths):
        found.setdefault(s.order.label, {}).setdefault(strengths[s.order.cell], []).append(s.right)
    return {e: {d: rate(by[d]) for d in sorted(by)} for e, by in sorted(found.items())}


def half_named(scores: Iterable[Score]) -> list[tuple[str, float]]:
    """Effects whose fainter strengths were tried, and the d' that is named in half the runs."""
    return [(effect, half(by)) for effect, by in named_by_strength(scores).items() if min(by) <= WITHIN * ORACLE]


def rising(rates: Sequence[Rate]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The likeliest rates that never fall (isotonic regression, weighted by n): a dip is chance, and so is a bump.

    >>> rising([Rate(1, 10), Rate(6, 10), Rate(2, 10), Rate(9, 10)]).tolist()
    [0.1, 0.4, 0.4, 0.9]
    """
    pools: list[Rate] = []
    sizes: list[int] = []
    for one in rates:
        pools.append(one)
        sizes.append(1)
        while len(pools) > 1 and pools[-2].value > pools[-1].value:
            last, size = pools.pop(), sizes.pop()
            pools[-1] = Rate(pools[-1].hits + last.hits, pools[-1].n + last.n)
            sizes[-1] += size
    return np.repeat([pool.value for pool in pools], sizes)


def half(rates: Mapping[float, Rate]) -> float:
    """Where a rate that does not fall crosses one half: a straight line over log d' between two strengths.

    The lowest strength where it is above half from the start, infinite where it never gets there.

    >>> half({2.0: Rate(0, 9), 8.0: Rate(9, 9)}), half({3.5: Rate(9, 10)}), half({8.0: Rate(2, 10)})
    (4.0, 3.5, inf)
    """
    strengths = sorted(rates)
    level = rising([rates[d] for d in strengths])
    above = np.flatnonzero(level >= 0.5)
    if not above.size:
        return float("inf")
    i = int(above[0])
    if i == 0:
        return strengths[0]
    share = (0.5 - level[i - 1]) / (level[i] - level[i - 1])
    low, high = np.log(strengths[i - 1]), np.log(strengths[i])
    return round(float(np.exp(low + share * (high - low))), 6)
