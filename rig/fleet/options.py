"""The options with which a command asks every file by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import click

from rig.errors import ConfigError

C = TypeVar("C", bound=Callable[..., object])

STORE = Path("fleet")
LIMIT = 600.0
LONGEST = 86400.0
"""s that one file may be given."""

_OPTIONS = (
    click.option(
        "--jobs",
        type=click.IntRange(min=1),
        metavar="N",
        help="Ask every file by itself, N at a time: a row of a Parquet table for each, kept in --store.",
    ),
    click.option(
        "--store",
        type=click.Path(file_okay=False, path_type=Path),
        help=f"With --jobs: folder of the rows; what it holds is not computed again.  [default: {STORE}]",
    ),
    click.option(
        "--limit", type=float, metavar="S", help=f"With --jobs: longest time for a file.  [default: {LIMIT:g}]"
    ),
)


def fleet_options(command: C) -> C:
    """--jobs, --store, --limit."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


@dataclass(frozen=True, slots=True)
class Fleet:
    """How many files are asked."""

    jobs: int
    store: Path
    limit: float


def fleet_of(jobs: int | None, store: Path | None, limit: float | None) -> Fleet | None:
    """None where a command is not to ask every file by itself. Raises ConfigError."""
    if jobs is None:
        given = [name for name, value in (("--store", store), ("--limit", limit)) if value is not None]
        if given:
            raise ConfigError(f"{', '.join(given)}: only with --jobs, which asks every file by itself; give --jobs 2")
        return None
    limit = LIMIT if limit is None else limit
    if not 0.0 < limit <= LONGEST:
        raise ConfigError(f"--limit must be above 0 s and at most {LONGEST:g} s, but is {limit:g} s")
    return Fleet(jobs, store or STORE, limit)


def refuse_beside(*given: tuple[str, object]) -> None:
    """Raises ConfigError for an option that has no meaning where every file has a row."""
    names = [name for name, value in given if value]
    if names:
        raise ConfigError(f"{', '.join(names)}: not with --jobs, which makes a row of each file; leave it out")
