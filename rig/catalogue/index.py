"""The index: a SQLite file with what was read of each file, and where it lies. A cache; nothing is lost with it."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import sqlite3
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, Final, TypeVar

from rig.catalogue.entry import Entry
from rig.catalogue.reading.files import Stamp
from rig.sqlite_transaction import transaction

T = TypeVar("T")

NAME: Final = ".thruster-rig-catalogue.sqlite"
PATIENCE: Final = 30.0
"""s that another process may write before this one gives up waiting for it."""
LONGEST: Final = 2000
"""Characters of a text that is kept."""
HINDERED: Final = frozenset(
    {sqlite3.SQLITE_PERM, sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_IOERR}
    | {sqlite3.SQLITE_FULL, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_NOLFS, sqlite3.SQLITE_PROTOCOL}
)
"""Primary result codes of SQLite that say that the place does not do;"""
FAULTS: Final = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
"""those that say that the index is at fault."""
COLUMNS: Final = tuple(each.name for each in fields(Entry) if each.name not in ("path", "facts", "recordings"))
SCHEMA: Final = (
    "CREATE TABLE files (path BLOB PRIMARY KEY, size INTEGER, mtime_ns INTEGER)",
    "CREATE TABLE entries (key INTEGER PRIMARY KEY, path BLOB REFERENCES files (path) ON DELETE CASCADE, "
    f"{', '.join(COLUMNS)}, facts)",
    "CREATE TABLE links (entry INTEGER REFERENCES entries (key) ON DELETE CASCADE, id)",
    "CREATE INDEX entries_of_file ON entries (path)",
    "CREATE INDEX entries_by_id ON entries (id)",
    "CREATE INDEX entries_by_time ON entries (what, began)",
    "CREATE INDEX links_of_entry ON links (entry)",
    "CREATE INDEX links_by_id ON links (id)",
)
READING: Final = 2
"""Raised when other things are read of a file, so that what was read before is read again."""


class Damaged(sqlite3.DatabaseError):
    """An index that can't be used: damaged, or a SQLite file of another program or version."""


def with_index(folder: Path, cache: Path, work: Callable[[sqlite3.Connection], T], say: Callable[[str], None]) -> T:
    """What `work` returns of the index of a folder: beside the data; in `cache` where that can't be; or in memory.

    `work` is done again when the index turns out to be damaged; `say` is told in one line what was not as it should be.
    """
    for place in places(folder, cache):
        try:
            return _with_index(place, work, say)
        except (sqlite3.OperationalError, OSError) as error:
            if isinstance(error, sqlite3.Error) and error.sqlite_errorcode & 0xFF not in HINDERED:
                raise
            say(f"the index {place} can't be used ({error})")
    with closing(_connected(":memory:")) as connection:
        say("nothing is kept: every file is read again each time")
        return work(connection)


def places(folder: Path, cache: Path) -> Iterator[Path]:
    """Where an index of the folder may be written."""
    beside = folder / NAME
    if os.access(beside if beside.exists() else folder, os.W_OK):
        yield beside
    yield cache / "thruster-rig" / f"catalogue-{hashlib.sha256(os.fsencode(folder)).hexdigest()[:16]}.sqlite"


def _with_index(place: Path, work: Callable[[sqlite3.Connection], T], say: Callable[[str], None]) -> T:
    if place.name != NAME:
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if os.path.lexists(place) and not stat.S_ISREG(place.lstat().st_mode):
        raise OSError("it is no regular file; remove it")
    with suppress(Damaged):
        return _worked(place, work)
    with _locked(place.parent):  # of two that both found it damaged the later one uses what the first has made
        try:
            return _worked(place, work)
        except Damaged as error:
            say(f"the index {place} was {error}: made anew")
        for name in (place, place.with_name(place.name + "-journal")):
            name.unlink(missing_ok=True)
        return _worked(place, work)


def _worked(place: Path, work: Callable[[sqlite3.Connection], T]) -> T:
    """Raises Damaged where the index itself is at fault."""
    try:
        with closing(_connected(place)) as connection:
            return work(connection)
    except UnicodeDecodeError as error:
        raise Damaged("damaged, a text of it is none") from error
    except sqlite3.DatabaseError as error:
        code = getattr(error, "sqlite_errorcode", None)  # none: of Python's module, for a text that is no UTF-8
        if isinstance(error, Damaged) or (code is not None and code & 0xFF not in FAULTS):
            raise
        told = " ".join(str(error).split())
        raise Damaged(f"damaged ({told[:80]})") from error


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _connected(place: Path | str) -> sqlite3.Connection:
    """A connection to an index of this version, made where there was none. Raises sqlite3.DatabaseError."""
    connection = sqlite3.connect(place, timeout=PATIENCE, isolation_level=None)
    try:
        for pragma in ("trusted_schema = off", "foreign_keys = on", "synchronous = normal"):
            connection.execute(f"PRAGMA {pragma}")
        with transaction(connection):
            made = [sql for (sql,) in connection.execute("SELECT sql FROM sqlite_master WHERE sql IS NOT NULL")]
            if not made:
                for statement in (*SCHEMA, f"PRAGMA user_version = {READING}"):
                    connection.execute(statement)
            elif made != list(SCHEMA) or connection.execute("PRAGMA user_version").fetchone() != (READING,):
                raise Damaged("not of this program and version")
    except BaseException:
        connection.close()
        raise
    return connection


def stamps(connection: sqlite3.Connection) -> dict[str, Stamp]:
    """Every file that was read, as it was then."""
    rows = connection.execute("SELECT path, size, mtime_ns FROM files")
    return {os.fsdecode(path): Stamp(size, mtime_ns) for path, size, mtime_ns in rows}


def forget(connection: sqlite3.Connection, paths: Iterable[str]) -> None:
    """With all that was said in these files."""
    connection.executemany("DELETE FROM files WHERE path = ?", [(os.fsencode(path),) for path in paths])


def keep(connection: sqlite3.Connection, path: str, stamp: Stamp, entries: Iterable[Entry]) -> None:
    """What a file says now, in place of what it said before."""
    forget(connection, [path])
    connection.execute("INSERT INTO files VALUES (?, ?, ?)", (os.fsencode(path), *stamp))
    marks = ", ".join("?" * (len(COLUMNS) + 2))
    for entry in entries:
        values = [_kept(getattr(entry, name)) for name in COLUMNS]
        facts = json.dumps(dict(entry.facts))
        into = f"INSERT INTO entries (path, {', '.join(COLUMNS)}, facts) VALUES ({marks})"  # noqa: S608 - our own names
        key = connection.execute(into, (os.fsencode(path), *values, facts)).lastrowid
        connection.executemany("INSERT INTO links VALUES (?, ?)", [(key, _kept(each)) for each in entry.recordings])


def _kept(value: Any) -> Any:
    """A text as SQLite can keep it."""
    return value[:LONGEST].encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value


def entry_of(row: Mapping[str, Any], recordings: tuple[str, ...] = ()) -> Entry:
    """A row of `entries`. Raises sqlite3.DatabaseError for one that no program of ours has written."""
    try:
        facts = json.loads(row["facts"])
        known = {name: row[name] for name in COLUMNS}
        return Entry(path=os.fsdecode(row["path"]), facts=facts, recordings=recordings, **known)
    except (TypeError, ValueError) as error:
        raise Damaged(f"damaged ({error})") from None
