"""Figures of several effects of field size at once, and of one more or another amount in a second recording. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final

import numpy as np

from rig.blind.design import STRENGTHS
from rig.blind.scoring.rates import Goal, of_groups, of_rate, rate
from rig.blind.scoring.score import TELLABLE, Score

CLEAR: Final = f"{STRENGTHS['clear']:g}"
CHANGED_CONSTANT: Final = "thrust_constant"
"""What a diagnosis against a twin says where C is another one. It never is here."""


def field_goals(scores: Sequence[Score]) -> list[Goal]:
    """Of composites of field size: names are counted effect by effect, what is said too much case by case."""
    return [
        of_groups(f"field, effects at {CLEAR} or more: named", _of_clear(scores, _named), least=0.90),
        of_groups(
            f"field, effects at {CLEAR} or more: named or among stated rivals", _of_clear(scores, _told), least=0.97
        ),
        of_rate("field: a name that is not there", rate(s.extra for s in scores), most=0.05),
        of_rate("field: unexplained", rate(s.said == "unexplained" for s in scores), most=0.10),
        *_errors("field", scores, 1.1, 1.4),
    ]


def difference_goals(scores: Sequence[Score]) -> list[Goal]:
    """Of a second recording against the twin of the first."""
    more, nothing, changed = (_labelled(scores, label) for label in ("one_more", "nothing", "changed"))
    return [
        of_rate("difference, one more: right or among stated rivals", rate(s.right for s in more), least=0.95),
        of_rate("difference, one more: exactly it", rate(s.exact for s in more), least=0.85),
        of_rate("difference, one more: wrong names", rate(s.wrong for s in more), most=0.02),
        of_rate("difference, nothing changed: alarms", rate(not s.right for s in nothing), most=0.03),
        of_rate("difference, another amount: right or among stated rivals", rate(s.right for s in changed), least=0.95),
        of_rate("difference, another amount: exactly it", rate(s.exact for s in changed), least=0.85),
        of_rate("difference, another amount: wrong names", rate(s.wrong for s in changed), most=0.02),
    ]


def composite_besides(field: Sequence[Score], difference: Sequence[Score]) -> list[Goal]:
    """What weighs those goals."""
    more = _labelled(difference, "one_more")
    faint = ([e in s.named for e in s.truth if e not in s.clear] for s in field)
    return [
        of_groups(f"field, effects below {CLEAR}: named", faint),
        of_rate(f"field: all effects at {CLEAR} or more named, and no other", rate(map(_whole, field))),
        of_rate("field, coverage of the 95 % interval of C", rate(_covers(field))),
        of_rate("field: crashed, refused or overdue", rate(s.failed for s in field)),
        *(
            of_rate(f"difference, one more: {what}, where all else leaves an oracle {TELLABLE:g} sigma", rate(said))
            for what, said in (
                ("right or among stated rivals", (s.right for s in more if s.counted)),
                ("exactly it", (s.exact for s in more if s.counted)),
            )
        ),
        of_rate("difference, one more: exactly it, and no rival stated", rate(s.alone for s in more)),
        of_rate("difference, one more: a name that is not there", rate(s.extra for s in more)),
        of_rate(
            "difference: a name that is not new, for the first recording has it as well",
            rate(bool(set(s.named) & set(s.known)) for s in difference),
        ),
        of_rate(
            "difference: a thrust constant that is said to have changed",
            rate(CHANGED_CONSTANT in s.named for s in difference),
        ),
        of_rate("difference, one more: unexplained", rate(s.said == "unexplained" for s in more)),
        *_errors("difference", difference),
        of_rate("difference: crashed, refused or overdue", rate(s.failed for s in difference)),
    ]


def composite_rows(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """Effect by effect, those of field size and those that came on top: how often there, named, among rivals."""
    found = []
    for name in ("field", "difference"):
        group = [s for s in scores if s.order.cell == name]
        found += [_row(name, effect, group) for effect in sorted({e for s in group for e in s.truth})]
    return found


def _row(cell: str, effect: str, scores: Sequence[Score]) -> dict[str, Any]:
    """Missed ones with what was said instead. What came on top was asked for at clear strength."""
    there = [s for s in scores if effect in s.truth]
    seen = [s for s in there if cell == "difference" or effect in s.clear]
    missed = [s for s in seen if not _told(s, effect)]
    return {
        "cell": cell,
        "effect": effect,
        "runs": len(there),
        "clear": len(seen),
        "named": sum(_named(s, effect) for s in seen),
        "among_rivals": sum(_told(s, effect) and not _named(s, effect) for s in seen),
        "faint_named": sum(_named(s, effect) for s in there if s not in seen),
        "said_where_missed": dict(
            Counter(" + ".join(sorted(set(s.named) - set(s.truth))) or s.said for s in missed).most_common()
        ),
        "named_where_not_there": sum(effect in s.named for s in scores if effect not in s.truth),
    }


def _of_clear(scores: Iterable[Score], found: Callable[[Score, str], bool]) -> list[list[bool]]:
    return [[found(s, effect) for effect in s.clear] for s in scores]


def _named(s: Score, effect: str) -> bool:
    return effect in s.named


def _told(s: Score, effect: str) -> bool:
    return effect in {*s.named, *s.rivals}


def _whole(s: Score) -> bool:
    return set(s.clear) <= set(s.named) <= set(s.truth) and s.said in ("explained", "ambiguous", "adequate")


def _errors(what: str, scores: Iterable[Score], half: float = np.inf, most: float = np.inf) -> list[Goal]:
    ratio = np.array([s.held_out.model for s in scores if s.held_out is not None])
    found = []
    for share, name, limit in ((0.5, "median", half), (0.95, "95 % of runs", most)):
        value = float(np.quantile(ratio, share)) if ratio.size else float("nan")
        told = f"{what}, held-out error over that of the true model, {name}"
        found.append(Goal(told, 0.0, limit, value, value, value, ratio.size, percent=False))
    return found


def _labelled(scores: Iterable[Score], label: str) -> list[Score]:
    return [s for s in scores if s.order.label == label]


def _covers(scores: Iterable[Score]) -> list[bool]:
    return [s.constant.covers for s in scores if s.constant is not None]
