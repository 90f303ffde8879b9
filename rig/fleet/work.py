"""A question carried out on many files: what is known is not asked, what comes is kept as it comes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

from rig.errors import RigError
from rig.fleet.engine import Answered, Engine, Failed, Order
from rig.fleet.files import sha256_of, stamp_of
from rig.fleet.question import Question, Row
from rig.fleet.store import Store

READERS = 4
"""Threads that hash files: they wait for disks, and hashing holds no lock of Python's."""
KEPT_AFTER = 1.0
"""s after which rows that came are written to the store: what a kill of this process costs."""


@dataclass(frozen=True)
class Outcome:
    """What came of it. Every file is in one of `same`, `known`, `made` or `failed`."""

    files: int
    same: int
    """Files with the bytes of another that was given too."""
    known: int
    """Answered by the store."""
    made: int
    """Answered now."""
    errors: dict[str, str]
    """SHA-256 of a recording that can't be used -> the sentence why; known or new."""
    failed: tuple[Failed, ...]


@dataclass
class _Keeping:
    """Rows on their way to the store."""

    store: Store
    question: Question
    rows: list[Row] = field(default_factory=list)
    since: float = 0.0

    def add(self, row: Row) -> None:
        now = time.monotonic()
        self.since = self.since if self.rows else now
        self.rows.append(row)
        if now - self.since >= KEPT_AFTER:
            self.flush()

    def flush(self) -> None:
        if self.rows:
            self.store.keep(self.question, self.rows)
            self.rows.clear()


def carry_out(
    question: Question,
    urls: Sequence[str],
    store: Store,
    engine: Engine,
    progress: Callable[[int], AbstractContextManager[Callable[[str], None]]],
) -> Outcome:
    """Ask all files; `progress` is given how many are to be asked, and what it holds the name of each that was.

    Raises RecordingError for a file that can't be read, StoreError; what came before is kept, also on Ctrl+C.
    """
    digests = digests_of(urls, store)
    first = {digest: url for url, digest in reversed(digests.items())}
    known = {digest for digest in store.answered(question) if digest in first}
    orders = [Order(question.key(digest), url) for digest, url in first.items() if digest not in known]
    orders.reverse()
    failed = _asked(question, orders, store, engine, progress)
    errors = {d: e for d, e in store.answered(question).items() if e is not None and d in first}
    made = len(orders) - len(failed)
    return Outcome(len(urls), len(urls) - len(first), len(known), made, errors, tuple(failed))


def _asked(
    question: Question,
    orders: Sequence[Order],
    store: Store,
    engine: Engine,
    progress: Callable[[int], AbstractContextManager[Callable[[str], None]]],
) -> list[Failed]:
    if not orders:
        return []
    keeping, failed = _Keeping(store, question), list[Failed]()

    def tell(found: Answered | Failed) -> None:
        if isinstance(found, Failed):
            failed.append(found)
        else:
            keeping.add(found[1])
        done(Path(found.order.url if isinstance(found, Failed) else found[0].url).name)

    try:
        with progress(len(orders)) as done:
            engine.carry_out(question, orders, tell)
    finally:
        keeping.flush()
    return failed


def digests_of(urls: Iterable[str], store: Store) -> dict[str, str]:
    """SHA-256 of each file, in order; of one whose stamp is as it was the store knows it. Raises RecordingError."""
    known, now = store.known_files(), time.time_ns()
    stamps = {url: stamp_of(url, now) for url in urls}
    new = [url for url, stamp in stamps.items() if not stamp or known.get(url, ("", ""))[0] != stamp]
    with ThreadPoolExecutor(READERS) as readers:
        found = dict(zip(new, readers.map(_sha256, new), strict=True))
    store.keep_files((url, stamps[url], digest) for url, digest in found.items())
    return {url: found[url] if url in found else known[url][1] for url in stamps}


def _sha256(url: str) -> str:
    try:
        return sha256_of(url)
    except OSError as error:
        raise RigError(f"{url} can't be read: {error.strerror}") from None
