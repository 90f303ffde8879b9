"""How far a proof is, while it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from rig.visible_text import console

if TYPE_CHECKING:
    from rig.blind.design import Job

EVERY = 25
"""Jobs between two lines of a log file."""


@contextmanager
def shown(count: int) -> Iterator[Callable[[Job], None]]:
    """A progress bar on a terminal, a line now and then elsewhere."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    screen = console(stderr=True)
    done = 0

    def tell(job: Job) -> None:
        nonlocal done
        done += 1
        if screen.is_terminal:
            bar.update(task, advance=1, description=job.id)
        elif done % EVERY == 0 or done == count:
            click.echo(f"{done} of {count} cases", err=True)

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=screen, disable=not screen.is_terminal) as bar:
        task = bar.add_task("the world wakes", total=count)
        yield tell
