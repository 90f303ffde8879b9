"""Choosing among the entries of an index: by filter, or by the beginning of an id."""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

from rig.catalogue.entry import UNCLOSED, Entry
from rig.catalogue.index import COLUMNS, entry_of
from rig.errors import ConfigError

QUIET: Final = {"recordings": 60.0, "campaigns": 3600.0}
"""s without a change after which what says `running` is taken to have been cut: a recorder writes four times a s, a
ledger once a step, and not while an operator mounts the next thruster."""
CUT: Final = (
    "outcome = 'running' AND (SELECT mtime_ns FROM files WHERE files.path = e.path) "
    "< CASE what WHEN 'campaigns' THEN :quiet_campaigns ELSE :quiet_recordings END"
)
SHOWN: Final = {
    "outcome": f"CASE WHEN {CUT} THEN :unclosed ELSE outcome END AS outcome",
    "reason": "CASE WHEN outcome <> 'running' OR what <> 'recordings' THEN reason "
    f"WHEN {CUT} THEN 'not closed in order; `rig recover` copies it' ELSE 'still being written' END AS reason",
}
"""What depends on the time at which it is asked."""
NO_FACTS: Final = "'{}' AS facts"


@dataclass(frozen=True, slots=True)
class Filter:
    """What is wanted; an empty field wants all. Times in s since 1970."""

    what: str = "recordings"
    thruster: str = ""
    kind: str = ""
    campaign: str = ""
    outcome: str = ""
    since: float | None = None
    until: float | None = None
    """Not itself."""


def selected(
    connection: sqlite3.Connection, wanted: Filter, newest: int | None = None, *, facts: bool = True
) -> list[Entry]:
    """In the order of time; the `newest` of them if given. `facts`: whether those are read, half of the time."""
    texts = [name for name in ("kind", "campaign", "outcome") if getattr(wanted, name)]
    clauses = ["what = :what", *(f"{name} = :{name}" for name in texts)]
    clauses += ["began >= :since"] if wanted.since is not None else []
    clauses += ["began < :until"] if wanted.until is not None else []
    if wanted.thruster and wanted.what == "campaigns":
        found = [
            each for each in _all(connection, clauses, wanted) if wanted.thruster in each.facts.get("thrusters", ())
        ]
        return found[-newest:] if newest else found
    clauses += ["thruster = :thruster"] if wanted.thruster else []
    if wanted.what == "calibrations":
        uses = merged(_all(connection, clauses, wanted))
        return uses[-newest:] if newest else uses
    return _all(connection, clauses, wanted, newest, facts=facts)


def counted(connection: sqlite3.Connection, wanted: Filter) -> int:
    """How many `selected` would give of recordings and results that are chosen by their outcome alone."""
    asked = "SELECT count(*) FROM entries WHERE what = ? AND outcome = ?"
    return int(connection.execute(asked, (wanted.what, wanted.outcome)).fetchone()[0])


def _all(
    connection: sqlite3.Connection,
    clauses: Iterable[str],
    wanted: Filter,
    newest: int | None = None,
    *,
    facts: bool = True,
) -> list[Entry]:
    values = {name: getattr(wanted, name) for name in wanted.__slots__}
    return list(_entries(connection, " AND ".join(clauses), values, newest, facts=facts))


def _entries(
    connection: sqlite3.Connection, where: str, values: dict[str, Any], newest: int | None = None, *, facts: bool = True
) -> Iterator[Entry]:
    connection.row_factory = sqlite3.Row
    shown = ", ".join(SHOWN.get(name, name) for name in COLUMNS)
    inner = f"SELECT key, path, {shown}, {'facts' if facts else NO_FACTS} FROM entries AS e"  # noqa: S608 - our own
    asked = f"SELECT * FROM ({inner}) WHERE {where} ORDER BY began DESC, path DESC, key DESC LIMIT :newest"  # noqa: S608 - our own
    since: dict[str, Any] = {f"quiet_{what}": int((time.time() - quiet) * 1e9) for what, quiet in QUIET.items()}
    since |= {"unclosed": UNCLOSED, "newest": newest or -1}
    rows = connection.execute(asked, values | since).fetchall()
    yield from map(entry_of, reversed(rows))


def merged(calibrations: Iterable[Entry]) -> list[Entry]:
    """One entry for each calibration, at the time of its last use, with how often it was used and since when."""
    by_id: dict[str, list[Entry]] = {}
    for each in calibrations:
        by_id.setdefault(each.id, []).append(each)
    out = []
    for uses in by_id.values():
        thrusters = sorted({use.thruster for use in uses if use.thruster})
        said = f"{uses[-1].said}, in {len(uses)} recording{'s' * (len(uses) > 1)} of {', '.join(thrusters) or '?'}"
        facts = {**uses[-1].facts, "uses": len(uses), "first_used": uses[0].began, "thrusters": thrusters}
        one = thrusters[0] if len(thrusters) == 1 else ""
        out.append(replace(uses[-1], thruster=one, said=said, facts=facts))
    return sorted(out, key=lambda each: each.began or 0.0)


def named(connection: sqlite3.Connection, asked: str, path: str | None) -> list[Entry]:
    """All entries of one file or one id, of which the beginning is enough. `path`: what `asked` is as a file below the
    folder. Raises ConfigError with the nearest where there is none, or several."""
    if path is not None:
        found = list(_entries(connection, "path = :path", {"path": os.fsencode(path)}))
        if found:
            return found
    within = {"low": asked, "high": asked + "\U0010ffff"}
    found = list(_entries(connection, "id >= :low AND id < :high", within)) if asked else []
    exact = [each for each in found if each.id == asked]
    ids = sorted({(each.what, each.id) for each in exact or found})
    if len(ids) == 1:
        return exact or found
    if ids:
        first = ", ".join(f"{identity} ({what})" for what, identity in ids[:5])
        raise ConfigError(
            f"{asked!r} is the beginning of {len(ids)} ids: {first}{', ...' * (len(ids) > 5)}; give more of it"
        )
    raise ConfigError(_unknown(connection, asked))


def _unknown(connection: sqlite3.Connection, asked: str) -> str:
    rows = connection.execute("SELECT DISTINCT id, path FROM entries")
    names = {name for identity, path in rows for name in (identity, os.fsdecode(path), Path(os.fsdecode(path)).name)}
    near = get_close_matches(asked, names - {""}, 3, 0.5)
    told = f"the nearest are {', '.join(near)}" if near else "`rig list` shows what there is"
    return f"{asked!r} is neither a file nor the beginning of an id here; {told}"


def recordings_of(connection: sqlite3.Connection, what: str) -> dict[tuple[str, str], tuple[str, ...]]:
    """(path, thruster) of each fit, twin or diagnosis to the ids of the recordings that it is of."""
    asked = "SELECT e.path, e.thruster, links.id FROM links JOIN entries AS e ON e.key = links.entry WHERE e.what = ?"
    found: dict[tuple[str, str], tuple[str, ...]] = {}
    for path, thruster, identity in connection.execute(asked, (what,)):
        key = (os.fsdecode(path), thruster)
        found[key] = (*found.get(key, ()), identity)
    return found


def related(connection: sqlite3.Connection, of: Entry) -> list[Entry]:
    """Of a recording: what is of it; of everything else: the recordings that it is of."""
    if of.what == "recordings":
        where = "key IN (SELECT entry FROM links WHERE id = :id)" if of.id else "0"
        return list(_entries(connection, where, {"id": of.id}))
    where = (
        "what = 'recordings' AND id IN (SELECT links.id FROM links JOIN entries AS o ON o.key = links.entry "
        "WHERE o.path = :path AND o.what = :what AND o.id = :id AND o.thruster = :thruster)"
    )
    if of.what == "calibrations":
        where = where.replace("o.path = :path AND ", "").replace(" AND o.thruster = :thruster", "")
    values = {"path": os.fsencode(of.path), "what": of.what, "id": of.id, "thruster": of.thruster}
    return list(_entries(connection, where, values))
