"""From doubt to answer: the next experiment, or why there is none. Pure: diagnoses and seconds are handed in.

A course begins with the diagnosis of what was recorded. While two answers are equally good the sweep that separates
them is run and everything is diagnosed again, until one answer stands, the time is spent, or the same doubt comes back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from identification.mismatch import policy
from identification.mismatch.diagnosis import Diagnosis, Finding, NextExperiment, VerdictName
from identification.mismatch.next_experiment.sweeps import BUDGET

Doubt = frozenset[frozenset[str]]
"""Sets of effects that are equally good answers; beside them the place that nothing explains."""
Reason = Literal["settled", "unexplained", "hopeless", "same_doubt", "budget", "aborted"]


@dataclass(frozen=True, slots=True)
class Belief:
    """What one diagnosis amounts to."""

    verdict: VerdictName
    says: str
    """As in `believed dead_band or exponent`."""
    effects: frozenset[str]
    """The findings; rivals are not among them."""
    doubt: Doubt
    """Empty: one answer stands."""
    experiment: NextExperiment | None


@dataclass(frozen=True, slots=True)
class Round:
    """One experiment and what was believed after it. Seconds."""

    ran: NextExperiment
    on_bench: float
    spent: float
    """Of the budget, when the diagnosis after it was there."""
    belief: Belief


@dataclass(frozen=True, slots=True)
class Course:
    """All that happened so far. Seconds."""

    budget: float
    first: Belief
    spent_first: float
    """Of the budget, when the first diagnosis was there."""
    rounds: tuple[Round, ...] = field(default=())

    @property
    def now(self) -> Belief:
        return self.rounds[-1].belief if self.rounds else self.first

    @property
    def spent(self) -> float:
        return self.rounds[-1].spent if self.rounds else self.spent_first

    @property
    def on_bench(self) -> float:
        return sum(each.on_bench for each in self.rounds)

    def after(self, on_bench: float, spent: float, found: Diagnosis) -> Course:
        """With one more round: its experiment was that of the present belief."""
        ran = self.now.experiment
        if ran is None:
            raise ValueError("a round needs an experiment, but none was proposed")
        return replace(self, rounds=(*self.rounds, Round(ran, on_bench, spent, belief(found))))


@dataclass(frozen=True, slots=True)
class End:
    """Nothing more is run."""

    reason: Reason
    says: str
    """One sentence."""


def belief(found: Diagnosis) -> Belief:
    """What a diagnosis says, as far as the next step depends on it."""
    doubt = frozenset(frozenset({f.effect, *rivals}) for f in found.findings if (rivals := _equals(f)))
    effects = frozenset(f.effect for f in found.findings)
    if found.unexplained is not None:
        doubt |= {frozenset({f"unexplained at {found.unexplained.where.quantity}"})}
    return Belief(found.verdict, _says(found), effects, doubt, found.next_experiment)


def _equals(found: Finding) -> list[str]:
    """Rivals that do as well."""
    return [rival.effect for rival in found.rivals if rival.bic_loss < policy.select.RIVALS_EQUAL_BIC]


def _says(found: Diagnosis) -> str:
    names = [" or ".join([f.effect, *_equals(f)]) for f in found.findings]
    known = ", and ".join(names)
    if found.unexplained is not None:
        place = f"something at {found.unexplained.where.quantity} that no term carries"
        return f"{place}, beside {known}" if known else place
    return known or "nothing is missing"


def next_step(course: Course, needs: float) -> NextExperiment | End:
    """The experiment to run, or the end. `needs`: s from now until the proposed one would be diagnosed."""
    now, left = course.now, course.budget - course.spent
    if now.experiment is None or not now.doubt:
        if now.verdict == "unexplained":
            return End("unexplained", f"{now.says}; no sweep is known that would tell what it is")
        return End("settled", f"one answer stands: {now.says}")
    if _survived(course) >= policy.next_experiment.SAME_DOUBT_ROUNDS:
        survived = f"the same doubt survived {policy.next_experiment.SAME_DOUBT_ROUNDS} rounds"
        return End("same_doubt", f"{now.says}: {survived}; {now.experiment.why}")
    if now.experiment.expected_power < policy.next_experiment.HOPELESS_POWER:
        return End("hopeless", f"{now.says}: no sweep tells them apart; {now.experiment.why}")
    if needs > left:
        return End("budget", f"{now.says}: the next experiment takes {needs:.0f} s, but {max(left, 0):.0f} s are left")
    return now.experiment


def _survived(course: Course) -> int:
    """Rounds at the end of the course that left the doubt as it was."""
    doubts = [course.first.doubt, *(each.belief.doubt for each in course.rounds)]
    count = 0
    while count + 1 < len(doubts) and doubts[-2 - count] == doubts[-1]:
        count += 1
    return count


def allowance(left: float, overhead: float) -> float:
    """S that the next sweep may take of the `left` s; `overhead`: what a round costs beside its sweep.

    Half of what is left, as long as a second sweep of the usual length fits into the other half.
    """
    room = left - overhead
    return max(room if room <= 2 * BUDGET else room / 2, policy.next_experiment.SHORTEST_SWEEP)


def opening_line(course: Course) -> str:
    """What is believed before anything is run."""
    return f"first: {course.first.verdict}: {course.first.says} ({_of(course.spent_first, course.budget)})"


def round_line(course: Course) -> str:
    """What was believed, what was run, what is believed now, and the time: of the latest round."""
    before = course.rounds[-2].belief if len(course.rounds) > 1 else course.first
    last = course.rounds[-1]
    same = "still " if last.belief.doubt == before.doubt else ""
    return (
        f"round {len(course.rounds)}: believed {before.says}; ran {last.on_bench:.0f} s that {last.ran.why} "
        f"(expected power {last.ran.expected_power:.2f}); now {same}{last.belief.verdict}: {last.belief.says} "
        f"({_of(last.spent, course.budget)})"
    )


def _of(spent: float, budget: float) -> str:
    return f"{_clock(spent)} of {_clock(budget)} min spent"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"


def course_json(course: Course, end: End) -> Mapping[str, object]:
    """`settling` of the answer's JSON."""
    return {
        "reason": end.reason,
        "statement": end.says,
        "budget": course.budget,
        "spent": course.spent,
        "on_bench": course.on_bench,
        "first": {"verdict": course.first.verdict, "believed": course.first.says},
        "rounds": [
            {
                "why": each.ran.why,
                "expected_power": each.ran.expected_power,
                "on_bench": each.on_bench,
                "spent": each.spent,
                "verdict": each.belief.verdict,
                "believed": each.belief.says,
            }
            for each in course.rounds
        ],
    }
