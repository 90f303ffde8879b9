"""A folder in which one process works at a time."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rig.errors import RigError


@contextmanager
def folder_locked(folder: Path, busy: RigError) -> Iterator[None]:
    """The folder, made where there is none, for us alone. Raises `busy` when another process has it."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("ab") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise busy from None
        yield
