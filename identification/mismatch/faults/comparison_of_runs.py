"""One run beside a sound one: which single change of one channel, or exchange of two, makes all relations agree again.

The channel to blame is the one that no other foretells any more while the others still foretell one another: so the
thrust is not blamed where the command, the rotation rate and the current changed against each other as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import exp, log
from typing import Literal

import numpy as np

from identification.mismatch import policy
from identification.mismatch.faults.cells import own
from identification.mismatch.faults.relations import (
    SQUARES,
    Curves,
    Relation,
    Table,
    curves_of,
    evenly,
    relation,
    run_to_run,
    strange_p,
    table_of,
)
from identification.recording import Floats, Recording

Change = Literal["swapped", "reversed", "rescaled", "driver", "strange"]
DRIVER = "command_voltage"
ROUGHER = 2.0
"""Times the error of the most precise relation of a channel, or the run-to-run variation: rougher ones have no vote."""
LEAST_ERROR = 0.005
"""Of a factor between runs: nearer to 1 is no more evidence."""


@dataclass(frozen=True, eq=False, slots=True)
class Changed:
    """What one channel of a run is against the sound run."""

    kind: Change
    channel: str
    p_value: float
    other: str = ""
    """It was exchanged with."""
    factor: float = 1.0
    """Of its size, measured over expected."""
    error: float = 0.0
    """Standard error of the factor's logarithm, run-to-run variation in it."""
    by: tuple[str, ...] = ()
    """What it was judged by."""
    sure: bool = True
    """Whether a third channel tells that it is this one."""


Relations = Mapping[tuple[str, str], Relation]


def relations_of(table: Table, sound: Curves) -> Relations:
    """(from, to) -> how they go together in this run, of all that the sound run relates and both runs hold."""
    found = {}
    for a, b in sound:
        if a in table.values and b in table.values:
            one = relation(table, sound, a, b)
            if one is not None:
                found[a, b] = one
    return found


def usually(found: Relations, without: str = "") -> dict[str, Relation]:
    """Of each channel its relation to the others: of those that are as precise as any the middle one, of two the
    nearer one, for one of them may be to a channel that is itself to blame. `without`: one that is not to be believed.
    """
    by: dict[str, list[Relation]] = {}
    for (a, b), one in found.items():
        if without not in (a, b):
            by.setdefault(b, []).append(one)
    precise = {b: [one for one in each if one.error <= _roughest(b, each)] for b, each in by.items()}
    return {b: sorted(each, key=_order)[(len(each) - 1) // 2] for b, each in precise.items()}


def _roughest(b: str, each: Sequence[Relation]) -> float:
    """Standard error up to which a relation has a vote."""
    return max(ROUGHER * min(one.error for one in each), run_to_run(b))


def _order(one: Relation) -> tuple[float, float]:
    return one.beyond, -one.explained


def broken(found: Relations, tests: int, without: str = "") -> dict[str, Relation]:
    """Channels that do not go with the others as they do in the sound run, `tests` of them looked at."""
    alarm = policy.faults.CHANNEL_FALSE_ALARM
    return {b: one for b, one in usually(found, without).items() if tests * one.p_value < alarm}


def apart(found: Relations) -> bool:
    """Whether some two channels go together so differently that the run is worth a closer look."""
    most = policy.faults.RELATION_APART
    return any(one.beyond > most or one.scatter > policy.faults.SCATTER_RUN_TO_RUN for one in found.values())


def changed(table: Table, sound: Table, curves: Curves, tests: int) -> Changed | None:
    """The change that explains all; None where nothing is broken, or nothing by itself explains it."""
    found = relations_of(table, curves)
    if not apart(found):
        return None
    bad = broken(found, tests)
    suspects = [_one(found, q, tests) for q in bad if _alone(found, q, tests)]
    kept = sorted(suspects, key=lambda s: _misfit(_explained(found, s)))
    left = _misfit(found) if not kept or kept[0].kind == "strange" else _misfit(_explained(found, kept[0]))
    p = min((one.p_value for one in bad.values()), default=1.0) * tests
    exchange = _exchange(table, sound, curves, left, p)
    if exchange is not None or not kept:
        return exchange
    beyond = [s for s in kept[1:] if policy.faults.EXCHANGED_BETTER * _misfit(_explained(found, s)) < left]
    if not beyond and len(usually(found, kept[0].channel)) > 1:
        return _meant(kept[0], table, sound)
    first = next((s for s in kept if s.channel == "thrust"), kept[0])
    return _meant(replace(first, sure=False, other=first.by[0] if first.kind == "strange" else ""), table, sound)


def _alone(found: Relations, q: str, tests: int) -> bool:
    """Whether all others go with one another as they do in the sound run once `q` is not believed."""
    return not broken(found, tests, q)


def _one(found: Relations, q: str, tests: int) -> Changed:
    """What the channel that is to blame underwent, from all that foretell it."""
    by = {a: one for (a, b), one in found.items() if b == q}
    following = {a: one for a, one in by.items() if one.follows}
    if not following:
        p = min(1.0, tests * max(one.p_value for one in by.values()))
        return Changed("strange", q, p, by=tuple(by))
    logs = np.array([one.log for one in following.values()])
    middle = sorted(following, key=lambda a: abs(following[a].log - float(np.median(logs))))[0]
    factor, one = exp(float(np.median(logs))), following[middle]
    p = min(1.0, tests * one.p_value)
    if one.factor < 0:
        return Changed("reversed", q, p, factor=factor, error=one.error, by=tuple(following))
    kind: Change = "driver" if q == DRIVER else "rescaled"
    return Changed(kind, q, p, factor=factor, error=one.error, by=tuple(following))


def _meant(one: Changed, table: Table, sound: Table) -> Changed | None:
    """None where it is less than what physics does to that channel from run to run."""
    size = abs(log(one.factor))
    if one.kind in ("reversed", "strange"):
        return one
    least = float(policy.faults.CHANGED_FACTOR)
    if one.channel in SQUARES:
        least **= 2
    if one.channel == "thrust" or not one.sure:
        least = float(policy.faults.NAMED_SCALE_FACTOR if one.sure else policy.faults.SCALE_FACTOR)
    if size < log(least) or (one.kind == "driver" and _by_supply(one.factor, table, sound)):
        return None
    return one


def _by_supply(factor: float, table: Table, sound: Table) -> bool:
    """Whether the supply explains a weaker drive: its voltage is lower by the same factor."""
    bus, was = (t.values.get("bus_voltage") for t in (table, sound))
    if bus is None or was is None:
        return False
    lower = float(np.nanmedian(np.abs(was)) / max(np.nanmedian(np.abs(bus)), 1e-300))
    return abs(log(max(lower, 1e-300) / factor)) < 0.5 * abs(log(factor))


def exchanges(table: Table) -> Iterator[tuple[str, str, Table]]:
    """Every two channels of which one is of the chain, and the table with them put back."""
    for a, b in combinations(table.values, 2):
        if a in table.chain or b in table.chain:
            put_back = exchanged(table.recording, a, b)
            again = None if put_back is None else table_of(put_back)
            if again is not None:
                yield a, b, again


def _explained(found: Relations, one: Changed) -> Relations:
    """The relations with the factor of the channel to blame taken out of those to it, and without those from it.

    A sign is a factor of -1 and no other: a supply that sags, in the place of a current, goes down as that goes up.
    """
    factor = -1.0 if one.kind == "reversed" else one.factor
    return {
        (a, b): replace(each, factor=each.factor / factor) if b == one.channel else each
        for (a, b), each in found.items()
        if a != one.channel
    }


def _exchange(table: Table, sound: Table, curves: Curves, left: float, p_value: float) -> Changed | None:
    """The two channels that, put back, make everything go together as in the sound run.

    `left`: the misfit without an exchange; `p_value`: that nothing changed.
    """
    tried, out = 0, []
    for a, b, again in exchanges(table):
        tried += 1
        both = [q for q in (a, b) if q in table.chain]
        if len(both) < 2 and not _as_before(table, sound, a, b):
            continue
        put_back = relations_of(again, curves)
        best = usually(put_back)
        worst = max((one.beyond for one in best.values()), default=np.inf)
        if worst > policy.faults.EXCHANGED_AGREE or not set(both) <= set(best):
            continue
        if _misfit(put_back) < policy.faults.EXCHANGED_BETTER * left:
            factor = max((best[q].factor for q in both), key=lambda f: abs(log(f)))
            by = tuple(q for q in best if q not in (a, b))
            out.append((worst, Changed("swapped", a, _chance([best[q] for q in both]), b, factor, by=by)))
    if not out:
        return None
    one = min(out, key=lambda f: f[0])[1]
    p = min(p_value, tried * one.p_value)
    return replace(one, p_value=p) if p < policy.faults.CHANNEL_FALSE_ALARM else None


def _misfit(found: Relations) -> float:
    """Root mean square of how far relations are from those of the sound run, in size and in shape; what follows no more
    counts as a factor of e."""
    squares = [
        min(one.log**2, 1.0) + 1.0 - one.explained if one.follows and one.factor > 0 else 1.0 for one in found.values()
    ]
    return float(np.sqrt(np.mean(squares))) if squares else np.inf


def _chance(put_back: Sequence[Relation]) -> float:
    """That two channels fit into each other's places so nearly by chance: the figures of channels lie anywhere within
    a factor of RANGE_OF_FIGURES either way."""
    span = 2 * log(policy.faults.RANGE_OF_FIGURES)
    return float(np.prod([min(1.0, 2 * max(abs(one.log), one.error, LEAST_ERROR) / span) for one in put_back]))


def _as_before(table: Table, sound: Table, a: str, b: str) -> bool:
    """Whether the one of the two that nothing foretells (a supply, a temperature), put back, is as in the sound run."""
    free, mine = (b, a) if a in table.chain else (a, b)
    was, now = sound.values.get(free), table.values[mine]
    if was is None:
        return False
    middle = float(np.nanmedian(was))
    return abs(float(np.nanmedian(now)) - middle) < policy.faults.OTHER_RUNS_AGREE * abs(middle)


def exchanged(recording: Recording, a: str, b: str) -> Recording | None:
    """With the samples of two channels put in each other's place."""
    one, other = own(recording, a), own(recording, b)
    if one is None or other is None:
        return None
    swap = {
        id(one): replace(one, time=other.time, value=other.value),
        id(other): replace(other, time=one.time, value=one.value),
    }
    return replace(recording, channels=tuple(swap.get(id(c), c) for c in recording.channels))


def stranger(table: Table) -> Changed | None:
    """A channel of a single run that goes with nothing where the others go together: a stranger, or one exchanged."""
    best = {q: _follows(table, q) for q in table.chain}
    lost = [q for q in best if best[q] < policy.faults.STRANGE_ALONE]
    others = [q for q in best if best[q] > policy.faults.STUCK_LAW]
    if len(lost) != 1 or len(others) < 2 or len(others) < len(best) - 1:
        return None
    (q,) = lost
    p = min(1.0, len(best) * strange_p(best[q], float(policy.faults.FOLLOWS_LAW)))
    if p >= policy.faults.CHANNEL_FALSE_ALARM:
        return None
    for a, b, again in exchanges(table):
        if q in (a, b) and not {a, b} <= set(table.chain) and _follows(again, q) > policy.faults.FOLLOWS_LAW:
            return Changed("swapped", a, p, other=b, by=tuple(others))
    shape = max((c.explained for (_, b), c in curves_of(table).items() if b == q), default=0.0)
    return Changed("strange", q, p, by=tuple(others)) if shape < policy.faults.STRANGE_ALONE else None


def _follows(table: Table, q: str) -> float:
    """R^2 of the channel with that other one of the chain which it goes with best by the laws of their kinds, sign and
    all."""
    lines = {a: evenly(a, table.values[a]) for a in table.chain}
    return max((_correlation(lines[q], lines[a]) ** 2 for a in lines if a != q), default=0.0)


def _correlation(x: Floats, y: Floats) -> float:
    good = np.isfinite(x) & np.isfinite(y)
    return max(float(np.corrcoef(x[good], y[good])[0, 1]), 0.0)
