"""What the commands of the catalogue share: the folder, its index brought up to date, dates, one line of a table."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import click

from rig.catalogue.entry import Entry, date_of, seconds_of
from rig.catalogue.index import with_index
from rig.catalogue.reading.files import LEDGER
from rig.catalogue.refresh import empty, refresh
from rig.errors import ConfigError
from rig.result_path import RESULT
from rig.visible_text import visible

T = TypeVar("T")
C = TypeVar("C", bound=Callable[..., object])

DAY: Final = 86400.0
"""s."""


def _since(_context: click.Context, parameter: click.Parameter, value: str | None) -> float | None:
    """A day or a time, UTC, in s since 1970; of a day its beginning. Raises click.BadParameter."""
    found = None if value is None else seconds_of(value)
    if value is not None and found is None:
        raise click.BadParameter(
            f"{value!r} is no date; expected 2026-03-01 or 2026-03-01T14:00 (UTC)", param=parameter
        )
    return found


def _until(context: click.Context, parameter: click.Parameter, value: str | None) -> float | None:
    """The same; of a day its end."""
    found = _since(context, parameter, value)
    return found + DAY if found is not None and value is not None and len(value.strip()) <= len("2026-03-01") else found


SINCE: Final = click.option(
    "--since", callback=_since, metavar="DATE", help="Begun on this day or later, e.g. 2026-03-01 (UTC)."
)
UNTIL: Final = click.option("--until", callback=_until, metavar="DATE", help="Begun on this day or earlier (UTC).")
REBUILD: Final = click.option("--rebuild", is_flag=True, help="Read every file again.")
JSON: Final = click.option("--json", "json_path", type=RESULT, help="Write it here for programs; - is standard output.")
CACHE: Final = click.option(
    "--cache",
    type=click.Path(path_type=Path),
    envvar="XDG_CACHE_HOME",
    default=Path("~/.cache"),
    show_default=True,
    help="Where the index is kept when the folder can't be written.",
)


class Place(NamedTuple):
    """The folder whose catalogue is asked, and the file in it that is meant; None: it is asked for an id."""

    folder: Path
    path: str | None

    @classmethod
    def of(cls, what: str, folder: Path | None) -> Place:
        """A file, the folder of a campaign or an id; a file outside of the folder is asked for where it lies."""
        root = folder or Path()
        candidates = [place for given in (Path(what), root / what) for place in (given / LEDGER, given)]
        file = next((each for each in candidates if each.is_file()), None)
        if file is None:
            return cls(root, None)
        where = file.parent.resolve() / file.name  # a link is listed under its own name
        if where.is_relative_to(root.resolve()):
            return cls(root, str(where.relative_to(root.resolve())))
        return cls(root, None) if folder else cls(where.parent, where.name)


def with_catalogue(folder: Path, cache: Path, work: Callable[[sqlite3.Connection], T], *, rebuild: bool = False) -> T:
    """What `work` returns of the index of a folder, brought up to date. Raises ConfigError for what is no folder."""
    if not folder.is_dir():
        raise ConfigError(f"{folder} is not a folder; give the one that recordings are in")
    folder = folder.resolve()

    def fresh(connection: sqlite3.Connection) -> T:
        if rebuild:
            empty(connection)
        refresh(connection, folder)
        return work(connection)

    return with_index(folder, cache.expanduser(), fresh, lambda text: click.echo(f"rig: {text}", err=True))


def tell(json_path: Path | None, document: Callable[[], dict[str, Any]], text: Callable[[], str]) -> None:
    """JSON where it is wanted; what a person reads on standard output, unless the JSON goes there."""
    if json_path is not None:
        written = json.dumps(document(), indent=1, allow_nan=False)
        if str(json_path) == "-":
            click.echo(written)
            return
        json_path.write_text(written + "\n", encoding="utf-8")
    click.echo(text())


def entry_json(entry: Entry) -> dict[str, Any]:
    """An entry as one object; what is not known is null or empty."""
    return {
        "what": entry.what,
        "id": entry.id,
        "path": entry.path.encode("utf-8", "backslashreplace").decode(),
        "thruster": entry.thruster,
        "kind": entry.kind,
        "campaign": entry.campaign,
        "began": date_of(entry.began, "milliseconds").replace(" ", "T") + "Z" if date_of(entry.began) else None,
        "duration": entry.duration,
        "outcome": entry.outcome,
        "operator": entry.operator,
        "bench": entry.bench,
        "said": entry.said,
        "reason": entry.reason,
        **entry.facts,
    }


def aligned(rows: Sequence[Sequence[str]], widest: int = 40) -> list[str]:
    r"""Rows as lines with columns below each other; the first row heads them. A column without a text is left out.

    A text longer than `widest` is cut, but in the last column.

    >>> aligned([("id", "none", "file"), ("a\x1b", "", "b"), ("longer", "", "c")])
    ['id       file', 'a\\u001b  b', 'longer   c']
    """
    shown = [[cell(text) for text in row] for row in rows]
    kept = [k for k in range(len(shown[0])) if any(row[k] for row in shown[1:])]
    cut = [[row[k] if k == kept[-1] else shortened(row[k], widest) for k in kept] for row in shown]
    widths = [max(columns(row[k]) for row in cut) for k in range(len(kept))]
    return [
        "  ".join(text + " " * (width - columns(text)) for text, width in zip(row, widths, strict=True)).rstrip()
        for row in cut
    ]


def cell(text: str) -> str:
    """On one line, and nothing in it that a terminal obeys."""
    return visible(" ".join(text.split()) if not text.isalnum() else text)


def shortened(text: str, widest: int) -> str:
    return text if len(text) <= widest else text[: widest - 1] + "…"


def columns(text: str) -> int:
    """Of a terminal."""
    if text.isascii():
        return len(text)
    from rich.cells import cell_len  # 60 ms, for wide letters alone

    return cell_len(text)


def spent(seconds: float | None) -> str:
    """A duration.

    >>> spent(93.2), spent(7300.0), spent(0.98), spent(None)
    ('1:33', '2:01:40', '1.0 s', '')
    """
    if seconds is None:
        return ""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
