"""Bringing an index up to date: only files that came or changed are read."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

from rig.catalogue import index
from rig.catalogue.entry import UNREAD, Entry
from rig.catalogue.reading import files
from rig.catalogue.reading.campaigns import read_campaign
from rig.catalogue.reading.documents import read_document
from rig.catalogue.reading.files import Stamp
from rig.catalogue.reading.recordings import read_recordings
from rig.sqlite_transaction import transaction

T = TypeVar("T")

BATCH: Final = 128
"""Files that one child reads, and that are kept together: a rebuild that is killed goes on where it was."""
RELATED: Final = "FROM links JOIN entries AS r ON r.id = links.id AND r.what = 'recordings' WHERE links.entry = e.key"
RELATE: Final = (
    "UPDATE entries AS e SET began = stated",
    f"UPDATE entries AS e SET began = (SELECT max(r.stated) {RELATED}) WHERE began IS NULL",  # noqa: S608 - our own
    f"UPDATE entries AS e SET began = (SELECT min(r.stated) {RELATED}) WHERE what = 'campaigns'",  # noqa: S608 - our own
    "UPDATE entries AS e SET began = (SELECT mtime_ns / 1e9 FROM files WHERE files.path = e.path) WHERE began IS NULL",
    *(
        f"UPDATE entries AS e SET {name} = ifnull((SELECT max(r.{name}) {RELATED}), '') "  # noqa: S608 - our own
        "WHERE what IN ('fits', 'twins', 'diagnoses')"
        for name in ("kind", "campaign", "operator", "bench")
    ),
    f"UPDATE entries AS e SET kind = ifnull((SELECT max(r.kind) {RELATED}), ''), "  # noqa: S608 - our own
    f"operator = ifnull((SELECT max(r.operator) {RELATED}), '') WHERE what = 'campaigns'",
)
"""What a result does not say of itself is that of the recordings it is of, where they are among the files."""


class Refreshed(NamedTuple):
    """What was done."""

    files: int
    read: int
    forgotten: int


def _nobody(done: int, of: int) -> None:
    """Is not told how far it is."""
    del done, of


def refresh(connection: sqlite3.Connection, folder: Path, tell: Callable[[int, int], None] = _nobody) -> Refreshed:
    """Until index and files agree, as the files were when they were looked at. `tell`: files read, of how many."""
    known, there = index.stamps(connection), files.found(folder)
    gone = known.keys() - there.keys()
    new = sorted(path for path, stamp in there.items() if known.get(path) != stamp)
    with transaction(connection):
        index.forget(connection, gone)
    done = 0
    for said in _read(folder, new):
        with transaction(connection):
            for path, entries in said:
                index.keep(connection, path, _as_read(there[path], entries), entries)
        done += len(said)
        tell(done, len(new))
    if gone or new:
        with transaction(connection):
            for statement in RELATE:
                connection.execute(statement)
    return Refreshed(len(there), len(new), len(gone))


def _as_read(stamp: Stamp, entries: Iterable[Entry]) -> Stamp:
    """One that the file will not have, where it was not read."""
    return stamp._replace(size=-1) if any(entry.facts.get(UNREAD) for entry in entries) else stamp


def empty(connection: sqlite3.Connection) -> None:
    """Everything forgotten, for a rebuild."""
    with transaction(connection):
        connection.execute("DELETE FROM files")


def _batches(items: Iterable[T]) -> Iterator[list[T]]:
    left = iter(items)
    while batch := list(islice(left, BATCH)):
        yield batch


def _read(folder: Path, paths: Sequence[str]) -> Iterator[list[tuple[str, list[Entry]]]]:
    """Of each file what it says, in batches; ledgers and results before the recordings."""
    recordings = [path for path in paths if path.endswith(files.RECORDINGS)]
    others = [path for path in paths if not path.endswith(files.RECORDINGS)]
    for batch in _batches(others):
        yield [(path, _read_other(folder, path)) for path in batch]
    if recordings:
        yield from read_recordings(folder, _batches(recordings))


def _read_other(folder: Path, path: str) -> list[Entry]:
    return read_document(folder, path) if path.endswith(files.DOCUMENTS) else read_campaign(folder, path)
