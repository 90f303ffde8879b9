"""The store on disk: every row that was computed, under its key, in SQLite. What is there is not computed again.

Of one recording and one way of asking the newest row is kept, so a table never has two. `stale` are the days whose
Parquet file is to be written again: marked in the same transaction as the row, so that no kill comes between.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from datetime import date
from pathlib import Path
from typing import Final

from rig.errors import RigError
from rig.fleet.question import Question, Row
from rig.sqlite_transaction import transaction
from rig.workers.locking import folder_locked

NAME: Final = "rows.sqlite"
FORMAT: Final = 1
UNDATED: Final = "__HIVE_DEFAULT_PARTITION__"
"""Value of a partition that has none, as Hive, DuckDB, Spark and Arrow write it."""
SCHEMA: Final = (
    "CREATE TABLE files (url TEXT PRIMARY KEY, stamp TEXT NOT NULL, sha256 TEXT NOT NULL)",
    "CREATE TABLE rows (tbl TEXT, asked TEXT, sha256 TEXT, version TEXT NOT NULL, day TEXT NOT NULL, error TEXT,"
    " row TEXT NOT NULL, PRIMARY KEY (tbl, asked, sha256))",
    "CREATE INDEX rows_by_day ON rows (tbl, day)",
    "CREATE TABLE stale (tbl TEXT, day TEXT, PRIMARY KEY (tbl, day))",
)


class StoreError(RigError):
    """A store that can't be used; the sentence says why."""


class Store:
    """The open store of one folder; one process at a time, see `opened`."""

    def __init__(self, root: Path, connection: sqlite3.Connection) -> None:
        self.root = root
        self.connection = connection

    def known_files(self) -> dict[str, tuple[str, str]]:
        """(stamp, SHA-256) of every file that was looked into, by its URL."""
        rows = self.connection.execute("SELECT url, stamp, sha256 FROM files")
        return {url: (stamp, digest) for url, stamp, digest in rows}

    def keep_files(self, found: Iterable[tuple[str, str, str]]) -> None:
        """Of (url, stamp, SHA-256)."""
        with transaction(self.connection):
            self.connection.executemany("INSERT OR REPLACE INTO files VALUES (?, ?, ?)", found)

    def places(self) -> dict[str, str]:
        """Where each recording was last seen: URL by SHA-256."""
        rows = self.connection.execute("SELECT sha256, url FROM files ORDER BY rowid")
        return dict(rows.fetchall())

    def answered(self, question: Question) -> dict[str, str | None]:
        """The error, None where there is none, of each recording that this version has answered, by its SHA-256."""
        rows = self.connection.execute(
            "SELECT sha256, error FROM rows WHERE tbl = ? AND asked = ? AND version = ?",
            (question.table, question.asked, question.version),
        )
        return dict(rows.fetchall())

    def answers(self, question: Question) -> list[Row]:
        """The rows without an error of what this version has answered."""
        rows = self.connection.execute(
            "SELECT row FROM rows WHERE tbl = ? AND asked = ? AND version = ? AND error IS NULL",
            (question.table, question.asked, question.version),
        )
        return [json.loads(text) for (text,) in rows]

    def forget(self, question: Question, digests: Sequence[str]) -> None:
        """These are to be answered again: until then the rows stand, as of an earlier version."""
        with transaction(self.connection):
            self.connection.executemany(
                "UPDATE rows SET version = '' WHERE tbl = ? AND asked = ? AND sha256 = ?",
                [(question.table, question.asked, digest) for digest in digests],
            )

    def keep(self, question: Question, rows: Sequence[Row]) -> None:
        """Each in place of what an earlier version answered; all or none."""
        with transaction(self.connection):
            for row in rows:
                self._keep(question, row)

    def _keep(self, question: Question, row: Row) -> None:
        which = (question.table, question.asked, row["sha256"])
        days = {
            day
            for (day,) in self.connection.execute(
                "SELECT day FROM rows WHERE tbl = ? AND asked = ? AND sha256 = ?", which
            )
        } | {day_of(row)}
        self.connection.executemany("INSERT OR IGNORE INTO stale VALUES (?, ?)", [(question.table, d) for d in days])
        text = json.dumps(row, allow_nan=False)
        self.connection.execute(
            "INSERT OR REPLACE INTO rows VALUES (?, ?, ?, ?, ?, ?, ?)",
            (*which, question.version, day_of(row), row["error"], text),
        )

    def stale_days(self, table: str) -> list[str]:
        """Days of which a row came since their Parquet file was written."""
        return [day for (day,) in self.connection.execute("SELECT day FROM stale WHERE tbl = ? ORDER BY day", (table,))]

    def rows_of(self, table: str, day: str | None = None) -> list[Row]:
        """Of a day, or all, in an order that does not depend on how they came."""
        rows = self.connection.execute(
            "SELECT row FROM rows WHERE tbl = ? AND (? IS NULL OR day = ?) ORDER BY day, sha256, asked",
            (table, day, day),
        )
        return [json.loads(text) for (text,) in rows]

    def is_written(self, table: str, day: str) -> None:
        """The Parquet file of a day holds what the store does."""
        with transaction(self.connection):
            self.connection.execute("DELETE FROM stale WHERE tbl = ? AND day = ?", (table, day))


@contextmanager
def opened(root: Path) -> Iterator[Store]:
    """The store of a folder, made where there is none, for this process alone. Raises StoreError."""
    busy = StoreError(f"another command works in {root}; wait for it, or give another --store")
    try:
        with folder_locked(root, busy), closing(_connected(root / NAME)) as connection:
            yield Store(root, connection)
    except sqlite3.Error as error:
        raise StoreError(
            f"{root / NAME} can't be used ({error}); move it away, and its rows are computed again"
        ) from error


def day_of(row: Row) -> str:
    """The day of a recording, from when it was made.

    >>> day_of({"created": "2026-11-26T18:00:00+00:00"}), day_of({"created": "yesterday"}) == UNDATED
    ('2026-11-26', True)
    """
    try:
        return date.fromisoformat(str(row.get("created"))[:10]).isoformat()
    except ValueError:
        return UNDATED


def _connected(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, isolation_level=None)
    try:
        connection.execute("PRAGMA synchronous = normal")
        connection.execute("PRAGMA journal_mode = wal")
        with transaction(connection):
            (found,) = connection.execute("PRAGMA user_version").fetchone()
            if not connection.execute("SELECT 1 FROM sqlite_master").fetchone():
                for statement in (*SCHEMA, f"PRAGMA user_version = {FORMAT}"):
                    connection.execute(statement)
            elif found != FORMAT:
                raise StoreError(
                    f"{path} is a store of version {found}, expected {FORMAT}; give another --store, or move it away"
                )
    except BaseException:
        connection.close()
        raise
    return connection
