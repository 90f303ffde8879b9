"""`rig list [FOLDER]`: recordings, campaigns and results of a folder, a line each, newest last."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import click

from rig.catalogue.asking import CACHE, JSON, REBUILD, SINCE, UNTIL, aligned, entry_json, spent, tell, with_catalogue
from rig.catalogue.entry import ONE, UNREADABLE, WHAT, Entry, date_of
from rig.catalogue.selection import Filter, counted, selected

SHORT: Final = 8
"""Letters of an id that are shown; `rig show` takes as few as are unique."""

Column = tuple[str, Callable[[Entry], str]]
_BEGAN: Final[Column] = ("began (UTC)", lambda e: date_of(e.began))
_ID: Final[Column] = ("id", lambda e: e.id[:SHORT])
_THRUSTER: Final[Column] = ("thruster", lambda e: e.thruster)
_CAMPAIGN: Final[Column] = ("campaign", lambda e: e.campaign)
_OUTCOME: Final[Column] = ("outcome", lambda e: e.outcome)
_SAID: Final[Column] = ("", lambda e: e.said)
_FILE: Final[Column] = ("file", lambda e: e.path)
_REASON: Final[Column] = ("", lambda e: e.reason)
COLUMNS: Final[Mapping[str, Sequence[Column]]] = {
    "recordings": (
        _BEGAN,
        _ID,
        _THRUSTER,
        ("kind", lambda e: e.kind),
        _CAMPAIGN,
        ("duration", lambda e: spent(e.duration)),
        _OUTCOME,
        _FILE,
        _REASON,
    ),
    "campaigns": (_BEGAN, ("id", lambda e: e.id), _CAMPAIGN, ("bench", lambda e: e.bench), _OUTCOME, _SAID, _REASON),
    "fits": (_BEGAN, _ID, _THRUSTER, _CAMPAIGN, _SAID, _FILE, _REASON),
    "twins": (_BEGAN, _ID, _THRUSTER, _CAMPAIGN, _SAID, _FILE, _REASON),
    "diagnoses": (_BEGAN, _ID, _THRUSTER, _OUTCOME, _SAID, _FILE, _REASON),
    "calibrations": (("last used (UTC)", lambda e: date_of(e.began)), _ID, _SAID),
}
WIDEST: Final = 60
"""Columns of a text before the last."""


@click.command("list")
@click.argument("folder", type=click.Path(path_type=Path), default=Path())
@click.option("--what", type=click.Choice(WHAT), default=WHAT[0], show_default=True, help="What is listed.")
@click.option("--thruster", default="", help="Of this thruster.")
@click.option("--kind", default="", help="Of this kind: tunnel, bollard or vehicle.")
@click.option("--campaign", default="", help="Of the campaign of this name.")
@click.option(
    "--outcome",
    default="",
    help="That came out so: completed, aborted, tripped, running, unclosed, unreadable; or a verdict.",
)
@SINCE
@UNTIL
@click.option("--limit", type=click.IntRange(min=1), help="The newest N only.")
@JSON
@REBUILD
@CACHE
def list_command(
    folder: Path,
    what: str,
    thruster: str,
    kind: str,
    campaign: str,
    outcome: str,
    since: float | None,
    until: float | None,
    limit: int | None,
    json_path: Path | None,
    rebuild: bool,
    cache: Path,
) -> None:
    """List the recordings in FOLDER and below, or campaigns, fits, twins, diagnoses, calibrations; the newest last.

    An index beside them keeps what was read; it may be deleted at any time.
    """
    wanted = Filter(what, thruster, kind, campaign, outcome, since, until)

    def work(connection: sqlite3.Connection) -> tuple[list[Entry], int]:
        found = selected(connection, wanted, limit, facts=json_path is not None)
        return found, counted(connection, Filter(what, outcome=UNREADABLE))

    found, unreadable = with_catalogue(folder, cache, work, rebuild=rebuild)
    nothing = f"no {what} in {folder}"
    tell(json_path, lambda: list_json(folder, wanted, found), lambda: list_text(what, found) or nothing)
    click.echo(
        f"{len(found)} {ONE[what] if len(found) == 1 else what}" + (", the newest" if len(found) == limit else ""),
        err=True,
    )
    if unreadable and outcome != UNREADABLE:
        click.echo(f"{unreadable} can't be read; why: rig list --what {what} --outcome {UNREADABLE}", err=True)


def list_text(what: str, entries: Sequence[Entry]) -> str:
    """A table; empty where there is nothing."""
    chosen = COLUMNS[what]
    rows = [tuple(of(entry) for _, of in chosen) for entry in entries]
    return "\n".join(aligned([tuple(heading for heading, _ in chosen), *rows], WIDEST)) if rows else ""


def list_json(folder: Path, wanted: Filter, entries: Sequence[Entry]) -> dict[str, Any]:
    """`thruster-rig-list` version 1."""
    return {
        "format": "thruster-rig-list",
        "version": 1,
        "folder": str(folder.resolve()),
        "what": wanted.what,
        "entries": [entry_json(entry) for entry in entries],
    }
