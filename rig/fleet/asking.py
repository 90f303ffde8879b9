"""Many files asked, their rows kept and written, and what came of it told."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import click

from rig.fleet.columns import Column
from rig.fleet.options import Fleet
from rig.fleet.parquet import require_pyarrow, write_stale
from rig.fleet.question import Question, Row
from rig.fleet.store import Store, opened
from rig.fleet.work import Outcome, carry_out
from rig.workers.interrupting import interruptible
from rig.workers.progress import shown

SHOWN = 10
"""Sentences about files that are printed; those about recordings are all in the table."""
EVERY = 500
"""Files between two lines of progress in a log."""


def ask_all(
    question: Question,
    columns: Sequence[Column],
    urls: Sequence[str],
    fleet: Fleet,
    stands: Callable[[Row], bool] | None = None,
) -> int:
    """Rows of all files (`rig.fleet.files.meant`) in the store, its Parquet up to date, a summary printed.

    `stands`: whether what a row says was made is still there; else it is made again. Raises RigError.
    Exit status: 0, or 1 where a file has no answer or can't be used.
    """
    require_pyarrow()
    with opened(fleet.store) as store, interruptible():
        if stands is not None:
            store.forget(question, [row["sha256"] for row in store.answers(question) if not stands(row)])
        found, days = asked(question, columns, urls, store, fleet)
    for sentence in _sentences(found):
        click.echo(f"  {sentence}", err=True)
    click.echo(f"{', '.join(_counts(found))}; {fleet.store / question.table}: {_days(len(days))} written")
    return 1 if found.errors or found.failed else 0


def asked(
    question: Question, columns: Sequence[Column], urls: Sequence[str], store: Store, fleet: Fleet
) -> tuple[Outcome, list[str]]:
    """What came of it, and the days whose Parquet was written; also on Ctrl+C, with what came until then."""
    try:
        found = carry_out(question, urls, store, fleet.engine, lambda count: shown(count, "files", "starting", EVERY))
    except KeyboardInterrupt:
        write_stale(store, question.table, columns)
        raise
    return found, write_stale(store, question.table, columns)


def _sentences(found: Outcome) -> Iterator[str]:
    every = [*(each.why for each in found.failed), *found.errors.values()]
    yield from every[:SHOWN]
    if len(every) > SHOWN:
        yield f"and {len(every) - SHOWN} more; the column `error` of the table has those about recordings"


def _counts(found: Outcome) -> Iterator[str]:
    yield f"{found.files} file{'s' if found.files != 1 else ''}"
    yield f"{found.made} computed"
    yield f"{found.known} known"
    if found.same:
        yield f"{found.same} the same as another"
    if found.errors:
        yield f"{len(found.errors)} can't be used"
    if found.failed:
        yield f"{len(found.failed)} without an answer: asked again the next time"


def _days(count: int) -> str:
    return f"{count} day{'s' if count != 1 else ''}"
