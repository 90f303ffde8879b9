"""All runs beside one another: which are sound, and what is changed in the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.mismatch.faults.comparison_of_runs import Changed, broken, changed, exchanged, relations_of, stranger
from identification.mismatch.faults.relations import Table, curves_of, evenly, table_of
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
    found: list[Differs] = []
    tables: list[Table] = []
    for recording in recordings:
        table = None if recording.kind == "vehicle" else table_of(recording)
        if table is None:
            continue
        own = stranger(table)
        if own is None:
            tables.append(table)
            continue
        found.append(Differs(recording, own, None, 1))
        put_back = exchanged(recording, own.channel, own.other) if own.other else None
        again = None if put_back is None else table_of(put_back)
        tables += [] if again is None else [again]
    if len(tables) > 1:
        found += _between(tables)
    return tuple(found)


def _between(tables: Sequence[Table]) -> list[Differs]:
    """Against the run that most others agree with; of two, the one that follows the laws of its channels."""
    many = len(tables)
    tests = (many - 1) * max(len(t.chain) for t in tables)
    curves = [curves_of(t) for t in tables]
    agree = np.eye(many, dtype=bool)
    for i in range(many):
        for j in range(many):
            agree[i, j] |= i != j and not broken(relations_of(tables[i], curves[j]), tests)
    agree &= agree.T
    if agree.all():
        return []
    lawless = np.array([_lawless(t) for t in tables])
    most = int(agree.sum(axis=1).max())
    among = np.flatnonzero(agree.sum(axis=1) == most)
    sound = int(among[np.argmin(np.round(lawless[among] / LAWLESS_STEP))])
    told = most > 1 or np.ptp(np.round(lawless[among] / LAWLESS_STEP)) > 0
    out = []
    for i in np.flatnonzero(~agree[sound]).tolist():
        one = changed(tables[i], tables[sound], tests)
        if one is not None:
            out.append(Differs(tables[i].recording, one, tables[sound].recording, many, bool(told)))
    return out


LAWLESS_STEP = 0.5
"""Of the mean logarithm of what the laws leave: less of a difference between two runs says nothing of which is right."""


def _lawless(table: Table) -> float:
    """Mean logarithm of the share of a channel that the law of its kind leaves: linear among voltages and rates, a
    square of either side for currents and forces."""
    left = []
    for a in table.chain:
        for b in table.chain:
            if a < b:
                x, y = (evenly(q, table.values[q]) for q in (a, b))
                good = np.isfinite(x) & np.isfinite(y)
                columns = np.column_stack([np.ones(x.size), np.maximum(x, 0), np.minimum(x, 0)])[good]
                rest = y[good] - columns @ np.linalg.lstsq(columns, y[good], rcond=None)[0]
                left.append(np.log(max(float(np.var(rest) / np.var(y[good])), 1e-4)))
    return float(np.mean(left)) if left else 0.0

