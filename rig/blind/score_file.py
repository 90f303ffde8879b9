"""Scores in a file: what another machine, or an earlier store, has answered by the same diagnosis need not be asked.

One JSON object a line (compressed when the name ends in .gz): the score, the version of the diagnosis that answered,
and a hash of what the world was asked for. Scores of another version or of another design are left alone.
"""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rig.blind.collecting import Known
from rig.blind.design import Job, Order
from rig.blind.scoring.score import HeldOut, Interval, Near, Score
from rig.blind.scoring.wired import Wired
from rig.blind.store import ProofError


def read(path: Path) -> list[Known]:
    """Empty when there is no such file. Raises ProofError for what is no score, OSError."""
    if not path.exists():
        return []
    found = []
    for number, line in enumerate(_text(path).splitlines(), 1):
        try:
            found.append(_known(json.loads(line)))
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise ProofError(
                f"{path}, line {number}: expected a score as `rig prove --scores` writes it: {error}"
            ) from error
    return found


def write(path: Path, known: Iterable[Known]) -> None:
    """In the order of their ids, each case and version once: the last. Raises OSError.

    A file that is there is replaced when all is written.
    """
    rows = [row for _, row in sorted({_key(each): each for each in known}.items())]
    text = "".join(json.dumps(_row(each), separators=(",", ":")) + "\n" for each in rows).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}")
    beside.write_bytes(gzip.compress(text, mtime=0) if path.suffix == ".gz" else text)
    beside.replace(path)


def add(path: Path, known: Iterable[Known]) -> None:
    """To what the file holds by now, for another proof may have written it meanwhile. Raises ProofError, OSError."""
    write(path, [*read(path), *known])


def usable(known: Iterable[Known], jobs: Sequence[Job], version: str, *, others: bool = False) -> dict[str, Known]:
    """By the ids of the orders of these jobs, those by this `version` of the diagnosis; or, as asked, by `others`."""
    asked = {order.id: job.digest for job in jobs for order in job.orders}
    mine = [each for each in known if asked.get(each.score.order.id) == each.asked]
    kept = sorted(
        (each for each in mine if others or each.version == version), key=lambda each: each.version == version
    )
    return {each.score.order.id: each for each in kept}


def unanswered(jobs: Sequence[Job], known: Mapping[str, Known]) -> list[Job]:
    """The jobs with their orders that are not among the known ones."""
    kept = (replace(job, orders=tuple(o for o in job.orders if o.id not in known)) for job in jobs)
    return [job for job in kept if job.orders]


def _key(known: Known) -> tuple[str, str, str]:
    return known.score.order.id, known.asked, known.version


def _row(known: Known) -> dict[str, Any]:
    return {**asdict(known.score), "version": known.version, "asked": known.asked}


def _known(row: dict[str, Any]) -> Known:
    version, asked = row.pop("version"), row.pop("asked")
    row |= {name: tuple(row[name]) for name in ("truth", "named", "rivals", "resembles")}
    row["order"] = Order(row["order"]["id"], tuple(row["order"]["without"]))
    row["near"] = None if row["near"] is None else Near(**row["near"])
    row["held_out"] = None if row["held_out"] is None else HeldOut(**row["held_out"])
    row["constant"] = Interval(**row["constant"]) if row.get("constant") else None
    row["wired"] = Wired(**row["wired"] | {"said": tuple(row["wired"]["said"])}) if row.get("wired") else None
    row["intervals"] = tuple(Interval(**each) for each in row["intervals"])
    row |= {name: tuple(row.get(name, ())) for name in ("strengths", "known", "not_shown")}
    return Known(Score(**row), version, asked)


def _text(path: Path) -> str:
    """Raises ProofError for what is not compressed as its name says."""
    said = path.read_bytes()
    try:
        return (gzip.decompress(said) if path.suffix == ".gz" else said).decode()
    except (gzip.BadGzipFile, zlib.error, EOFError, UnicodeDecodeError) as error:
        raise ProofError(f"{path}: expected scores as `rig prove --scores` writes them: {error}") from error
