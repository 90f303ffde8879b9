"""How far many jobs are, while they run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

from rig.visible_text import console

EVERY = 25
"""Jobs between two lines of a log file."""


@contextmanager
def shown(count: int, what: str, first: str, every: int = EVERY) -> Iterator[Callable[[str], None]]:
    """A progress bar on a terminal, a line for each `every` of them elsewhere; called with the name of each job done.

    `what` they are, in the plural; `first` is said until the first is done.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    screen = console(stderr=True)
    done = 0

    def tell(name: str) -> None:
        nonlocal done
        done += 1
        if screen.is_terminal:
            bar.update(task, advance=1, description=name)
        elif done % every == 0 or done == count:
            click.echo(f"{done} of {count} {what}", err=True)

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=screen, disable=not screen.is_terminal) as bar:
        task = bar.add_task(first, total=count)
        yield tell
