"""All runs beside one another: which are sound, and what is changed in the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.mismatch.faults.comparison_of_runs import (
    Changed,
    apart,
    broken,
    changed,
    exchanged,
    relations_of,
    stranger,
)
from identification.mismatch.faults.relations import Curves, Table, curves_of, lawless, table_of
from identification.recording import Recording


@dataclass(frozen=True, eq=False, slots=True)
class Differs:
    """One run that is wired otherwise."""

    recording: Recording
    changed: Changed
    beside: Recording | None
    """The run that it was judged by; None where its own channels tell."""
    runs: int
    """That were compared."""
    known: bool = True
    """Whether it is known to be this run, and not the other one."""


def differing(recordings: Sequence[Recording]) -> tuple[Differs, ...]:
    """Runs of one thruster in which something is wired, scaled, signed or driven otherwise than in the others."""
    tables = [t for r in recordings if r.kind != "vehicle" and (t := table_of(r)) is not None]
    alone = [stranger(t) for t in tables]
    found = _between(tables, [one is None for one in alone]) if len(tables) > 1 else {}
    for i, one in enumerate(alone):
        if one is not None and i not in found:
            found[i] = Differs(tables[i].recording, one, None, 1)
    return tuple(found[i] for i in sorted(found))


def _between(tables: Sequence[Table], whole: Sequence[bool]) -> dict[int, Differs]:
    """Against the run that most others agree with; of two, the one that follows the laws of its channels.

    `whole`: of each run, whether its channels go together at all.
    """
    many = len(tables)
    tests = (many - 1) * max(len(t.chain) for t in tables)
    curves = [curves_of(t) for t in tables]
    beside = {(i, j): relations_of(tables[i], curves[j]) for i in range(many) for j in range(many) if i != j}
    if not any(apart(found) for found in beside.values()):
        return {}
    agree = np.eye(many, dtype=bool)
    for (i, j), found in beside.items():
        agree[i, j] = not (broken(found, tests) or broken(beside[j, i], tests))
    laws = np.array([lawless(t) for t in tables])
    rank = [(not whole[i], -int(agree[i].sum()), round(laws[i] / LAWLESS_STEP), i) for i in range(many)]
    sound = min(range(many), key=rank.__getitem__)
    out = _against(sound, tables, curves, tests)
    if many == 2 and any(one.changed.kind == "swapped" for one in out.values()):
        return _more_lawful(out, tables, _against(1 - sound, tables, curves, tests))
    if many == 2 and sound == 1 and not any(one.changed.kind in BY_LAW for one in out.values()):
        out = _against(0, tables, curves, tests) or out  # the figures say nothing of which run: the later one is named
    return out


def _more_lawful(one: dict[int, Differs], tables: Sequence[Table], other: dict[int, Differs]) -> dict[int, Differs]:
    """Of two runs of which either may be the one with the exchange, that whose channels follow the laws of their kinds
    better once they are put back."""
    gained = {}
    for found in (one, other):
        for i, each in found.items():
            put_back = exchanged(tables[i].recording, each.changed.channel, each.changed.other)
            again = None if put_back is None else table_of(put_back)
            gained[i] = -np.inf if again is None else lawless(tables[i]) - lawless(again)
    best = max(gained, key=gained.__getitem__)
    return one if best in one else other


def _against(sound: int, tables: Sequence[Table], curves: Sequence[Curves], tests: int) -> dict[int, Differs]:
    """What is changed in each of the runs against the sound one."""
    out = {}
    for i in range(len(tables)):
        one = changed(tables[i], tables[sound], curves[sound], tests) if i != sound else None
        if one is not None:
            known = len(tables) > 2 or one.kind in BY_LAW
            out[i] = Differs(tables[i].recording, one, tables[sound].recording, len(tables), known)
    return out


BY_LAW = ("swapped", "strange")
"""Changes of which a run's own channels tell that it is this run."""
LAWLESS_STEP = 0.5
"""Of the mean logarithm of what the laws leave: a lesser difference says nothing of which of two runs is right."""
