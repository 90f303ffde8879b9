"""Scores in a file: what another machine, or an earlier store, has answered by the same diagnosis need not be asked.

One JSON object a line (compressed when the name ends in .gz): the score, the version of the diagnosis that answered,
and a hash of what the world was asked for. Scores of another version or of another design are left alone.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rig.blind.collecting import Known
from rig.blind.design import Job, Order
from rig.blind.scoring import HeldOut, Interval, Near, Score
from rig.blind.store import ProofError


def read(path: Path) -> dict[str, Known]:
    """By the id of the order; empty when there is no such file. Raises ProofError for what is no score, OSError."""
    if not path.exists():
        return {}
    found = {}
    for number, line in enumerate(_text(path).splitlines(), 1):
        try:
            known = _known(json.loads(line))
        except (ValueError, TypeError, KeyError) as error:
            raise ProofError(
                f"{path}, line {number}: expected a score as `rig prove --scores` writes it: {error}"
            ) from error
        found[known.score.order.id] = known
    return found


def write(path: Path, known: Iterable[Known]) -> None:
    """In the order of their ids; a file that is there is replaced when all is written. Raises OSError."""
    rows = sorted(known, key=lambda each: each.score.order.id)
    text = "".join(json.dumps(_row(each), separators=(",", ":")) + "\n" for each in rows).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}")
    beside.write_bytes(gzip.compress(text, mtime=0) if path.suffix == ".gz" else text)
    beside.replace(path)


def usable(known: Mapping[str, Known], jobs: Sequence[Job], version: str = "") -> dict[str, Known]:
    """Those of the orders of these jobs; with `version` only those by this version of the diagnosis."""
    asked = {order.id: job.digest for job in jobs for order in job.orders}
    return {
        name: each for name, each in known.items() if asked.get(name) == each.asked and version in ("", each.version)
    }


def unanswered(jobs: Sequence[Job], known: Mapping[str, Known]) -> list[Job]:
    """The jobs with their orders that are not among the known ones."""
    kept = (replace(job, orders=tuple(o for o in job.orders if o.id not in known)) for job in jobs)
    return [job for job in kept if job.orders]


def _row(known: Known) -> dict[str, Any]:
    return {**asdict(known.score), "version": known.version, "asked": known.asked}


def _known(row: dict[str, Any]) -> Known:
    version, asked = row.pop("version"), row.pop("asked")
    row |= {name: tuple(row[name]) for name in ("truth", "named", "rivals", "resembles")}
    row["order"] = Order(row["order"]["id"], tuple(row["order"]["without"]))
    row["near"] = None if row["near"] is None else Near(**row["near"])
    row["held_out"] = None if row["held_out"] is None else HeldOut(**row["held_out"])
    row["intervals"] = tuple(Interval(**each) for each in row["intervals"])
    return Known(Score(**row), version, asked)


def _text(path: Path) -> str:
    """Raises ProofError for what is not compressed as its name says."""
    said = path.read_bytes()
    try:
        return (gzip.decompress(said) if path.suffix == ".gz" else said).decode()
    except (gzip.BadGzipFile, EOFError, UnicodeDecodeError) as error:
        raise ProofError(f"{path}: expected scores as `rig prove --scores` writes them: {error}") from error
