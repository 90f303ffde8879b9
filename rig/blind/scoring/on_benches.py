"""Figures of the cases that were recorded on benches in virtual time, beside their goals. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from rig.blind.design import BENCH_STRENGTHS, PAIR_STRENGTH
from rig.blind.scoring.rates import Goal, of_groups, of_rate, rate
from rig.blind.scoring.score import TELLABLE, Score


def bench_goals(scores: Sequence[Score]) -> list[Goal]:
    """Those of arrays at the same strengths; and C, where nothing else is said than what is there."""
    single = [s for s in scores if len(s.truth) == 1]
    clear, plain = _labelled(scores, "clear:"), _labelled(scores, "plain:")
    nothing, pairs = _labelled(scores, "nothing"), _labelled(scores, "pair")
    ratio = np.array([s.held_out.model for s in scores if s.truth and s.held_out is not None])
    found = [
        of_rate("bench, nothing concealed: false alarms", rate(not s.right for s in nothing), most=0.02),
        of_rate("bench, clear: right or among stated rivals", rate(s.right for s in clear), least=0.97),
        of_rate("bench, clear: right alone", rate(s.alone for s in clear), least=0.90),
        of_rate("bench, plain: right or among stated rivals", rate(s.right for s in plain), least=0.99),
        of_rate("bench, plain: right alone", rate(s.alone for s in plain), least=0.95),
        of_rate("bench, wrong names, one effect", rate(s.wrong for s in single), most=0.01),
        of_rate(
            "bench, unexplained beside a right effect",
            rate(s.said == "unexplained" for s in single if s.right),
            most=0.03,
        ),
        of_rate(
            f"bench, pairs at {PAIR_STRENGTH:g}: both right or among stated rivals",
            rate(s.right for s in pairs),
            least=0.92,
        ),
        of_rate("bench, coverage of the 95 % interval of C", rate(_covers(s for s in scores if s.alone)), 0.93, 0.97),
        of_groups(
            "bench, coverage of the 95 % intervals of effects' parameters",
            ([i.covers for i in s.intervals] for s in scores),
            0.93,
            0.97,
        ),
    ]
    for what, share, most in (("median", 0.5, 1.05), ("95 % of runs", 0.95, 1.3)):
        value = float(np.quantile(ratio, share)) if ratio.size else float("nan")
        name = f"bench, held-out error over that of the true model, {what}"
        found.append(Goal(name, 0.0, most, value, value, value, ratio.size, percent=False))
    return found


def bench_besides(scores: Sequence[Score]) -> list[Goal]:
    """C in all answers, also those that say too much or too little; names that are not there."""
    tellable = [
        of_rate(
            f"bench, {name}: right alone, where the nearest neighbour leaves an oracle {TELLABLE:g} sigma",
            rate(s.alone for s in _labelled(scores, f"{name}:") if s.counted),
        )
        for name in BENCH_STRENGTHS
    ]
    return [
        *tellable,
        of_rate("bench, coverage of the 95 % interval of C, whatever was said", rate(_covers(scores))),
        of_rate("bench, one effect: a name that is not there", rate(s.extra for s in scores if len(s.truth) == 1)),
        of_rate("bench: crashed, refused or overdue", rate(s.failed for s in scores)),
    ]


def _labelled(scores: Iterable[Score], begin: str) -> list[Score]:
    return [s for s in scores if s.order.label.startswith(begin)]


def _covers(scores: Iterable[Score]) -> list[bool]:
    return [s.constant.covers for s in scores if s.constant is not None]
