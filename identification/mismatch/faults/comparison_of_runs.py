"""One run beside a sound one: which single change of one channel, or exchange of two, makes all relations agree again.

The channel to blame is the one that no other foretells any more while the others still foretell one another: so the
thrust is not blamed where the command, the rotation rate and the current changed against each other as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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
    strange_p,
    table_of,
)
from identification.recording import Floats, Recording

Change = Literal["swapped", "reversed", "rescaled", "driver", "strange"]
DRIVER = "command_voltage"


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


def best_foretold(found: Relations, without: str = "") -> dict[str, Relation]:
    """Of each channel, its relation to the one that foretells it best; `without`: of one that is not to be believed."""
    out: dict[str, Relation] = {}
    for (a, b), one in found.items():
        if without not in (a, b) and (b not in out or _order(one) < _order(out[b])):
            out[b] = one
    return out


def _order(one: Relation) -> tuple[float, float]:
    return one.beyond, -one.explained


def broken(found: Relations, tests: int, without: str = "") -> dict[str, Relation]:
    """Channels that go with none of the others as they do in the sound run, `tests` of them looked at."""
    alarm = policy.faults.CHANNEL_FALSE_ALARM
    return {b: one for b, one in best_foretold(found, without).items() if tests * one.p_value < alarm}


def changed(table: Table, sound: Table, tests: int) -> Changed | None:
    """The change that explains all; None where nothing is broken, or nothing by itself explains it."""
    curves = curves_of(sound)
    found = relations_of(table, curves)
    bad = broken(found, tests)
    if not bad:
        return None
    p = min(1.0, tests * min(one.p_value for one in bad.values()))
    kept = sorted((_one(found, q, tests) for q in bad if _alone(found, q, tests)), key=lambda s: s.p_value)
    if not kept or kept[0].kind == "strange":
        exchange = _exchange(table, sound, curves, bad)
        if exchange is not None:
            return replace(exchange, p_value=p)
    if not kept:
        return None
    sure = len(kept) == 1 and len(best_foretold(found, kept[0].channel)) > 1
    kept = kept if sure else [s for s in kept if s.channel == "thrust"] or kept
    return _meant(replace(kept[0], sure=sure), table, sound)


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


def _exchange(table: Table, sound: Table, curves: Curves, bad: Mapping[str, Relation]) -> Changed | None:
    """The two channels that, put back, make everything go together as in the sound run."""
    found = []
    for a, b, again in exchanges(table):
        both = {a, b} & set(table.chain)
        if not both & set(bad) or (both != {a, b} and not _as_before(table, sound, a, b)):
            continue
        best = best_foretold(relations_of(again, curves))
        worst = max((one.beyond for one in best.values()), default=np.inf)
        if set(best) >= set(bad) & set(again.chain) and worst < policy.faults.EXCHANGED_AGREE:
            factor = max((one.factor for q, one in best.items() if q in (a, b)), key=lambda f: abs(log(f)))
            found.append((worst, Changed("swapped", a, 0.0, other=b, factor=factor, by=tuple(set(best) - {a, b}))))
    return min(found, key=lambda f: f[0])[1] if found else None


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
    curves = curves_of(table)
    best = {q: max((c.explained for (a, b), c in curves.items() if b == q), default=0.0) for q in table.chain}
    lost = [q for q in best if best[q] < policy.faults.STRANGE_ALONE]
    others = [q for q in best if best[q] > policy.faults.STUCK_LAW]
    if len(lost) != 1 or len(others) < 2 or len(others) < len(best) - 1:
        return None
    (q,) = lost
    p = min(1.0, len(best) * strange_p(best[q], float(policy.faults.FOLLOWS_LAW)))
    if p >= policy.faults.CHANNEL_FALSE_ALARM:
        return None
    for a, b, again in exchanges(table):
        if q in (a, b) and not {a, b} <= set(table.chain) and _all_follow(again):
            return Changed("swapped", a, p, other=b, by=tuple(others))
    return Changed("strange", q, p, by=tuple(others))


def _all_follow(table: Table) -> bool:
    """Each of the chain goes with some other one, sign and all."""
    lines = {q: evenly(q, table.values[q]) for q in table.chain}
    return all(
        max(_correlation(lines[q], lines[a]) for a in lines if a != q) ** 2 > policy.faults.FOLLOWS_LAW for q in lines
    )


def _correlation(x: Floats, y: Floats) -> float:
    good = np.isfinite(x) & np.isfinite(y)
    return max(float(np.corrcoef(x[good], y[good])[0, 1]), 0.0)
