"""How far a proof is, while it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rig.workers import progress

if TYPE_CHECKING:
    from rig.blind.design import Job


@contextmanager
def shown(count: int) -> Iterator[Callable[[Job], None]]:
    """A progress bar on a terminal, a line now and then elsewhere."""
    with progress.shown(count, "cases", "the world wakes") as told:
        yield lambda job: told(job.id)
