"""The options with which a command asks every file by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import click

from rig.errors import ConfigError
from rig.fleet.dask_cluster import DaskCluster, require_distributed
from rig.fleet.engine import Engine
from rig.fleet.local import Local

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
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help="The same on the workers of a Dask cluster, by its scheduler.",
    ),
    click.option(
        "--store",
        type=click.Path(file_okay=False, path_type=Path),
        help=f"With these: folder of the rows; what it holds is not computed again.  [default: {STORE}]",
    ),
    click.option(
        "--limit", type=float, metavar="S", help=f"With --jobs: longest time for a file.  [default: {LIMIT:g}]"
    ),
)


def fleet_options(command: C) -> C:
    """--jobs, --scheduler, --store, --limit."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


@dataclass(frozen=True, slots=True)
class Fleet:
    """How many files are asked, and by whom: `jobs` processes here, or a cluster by its `scheduler`."""

    jobs: int
    store: Path
    limit: float
    scheduler: str = ""

    @property
    def engine(self) -> Engine:
        """Who carries the orders out. Raises ConfigError where what it needs is not installed."""
        if not self.scheduler:
            return Local(self.jobs, self.limit, self.store)
        require_distributed()
        return DaskCluster(self.scheduler)


def fleet_of(jobs: int | None, scheduler: str | None, store: Path | None, limit: float | None) -> Fleet | None:
    """None where a command is not to ask every file by itself. Raises ConfigError."""
    if jobs is None and scheduler is None:
        given = [name for name, value in (("--store", store), ("--limit", limit)) if value is not None]
        if given:
            raise ConfigError(f"{', '.join(given)}: only with --jobs, which asks every file by itself; give --jobs 2")
        return None
    if scheduler is not None and (jobs is not None or limit is not None):
        raise ConfigError(
            "--jobs, --limit: not with --scheduler: how many processes there are, and what becomes of one that takes "
            "too long, is said where the workers are started"
        )
    limit = LIMIT if limit is None else limit
    if not 0.0 < limit <= LONGEST:
        raise ConfigError(f"--limit must be above 0 s and at most {LONGEST:g} s, but is {limit:g} s")
    return Fleet(jobs or 1, store or STORE, limit, scheduler or "")


def refuse_beside(*given: tuple[str, object]) -> None:
    """Raises ConfigError for an option that has no meaning where every file has a row."""
    names = [name for name, value in given if value]
    if names:
        raise ConfigError(f"{', '.join(names)}: not with --jobs, which makes a row of each file; leave it out")
