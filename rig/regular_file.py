"""Opening a file that somebody named: a regular one, of a size that is expected, or a sentence. Never waits."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

from rig.errors import RigError

KINDS: Final = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe (FIFO)",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def read(path: Path, what: str, most: int, refusal: type[RigError]) -> bytes:
    """All of it; what comes while it is read is not in it. Raises FileNotFoundError; `refusal` for all else.

    `what` names it in the sentence (`bench file`).
    """
    with _opened(path, what, most, refusal) as (file, size):
        return file.read(size)


def beginning(path: Path, what: str, size: int, refusal: type[RigError]) -> bytes:
    """The first `size` bytes, or as many as there are, of a file of any length. Raises as `read` does."""
    with _opened(path, what, None, refusal) as (file, _):
        return file.read(size)


@contextmanager
def _opened(path: Path, what: str, most: int | None, refusal: type[RigError]) -> Iterator[tuple[BinaryIO, int]]:
    """The file and its bytes."""
    try:
        # not blocking: opening a pipe waits for who writes to it
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise refusal(f"{path}: this {what} can't be read: {getattr(error, 'strerror', None) or error}") from None
    try:
        found = os.fstat(descriptor)
        _require_regular(found, path, what, most, refusal)
        with os.fdopen(os.dup(descriptor), "rb") as file:
            yield file, found.st_size
    except OSError as error:
        raise refusal(f"{path}: this {what} can't be read: {error.strerror}") from None
    finally:
        os.close(descriptor)


def _require_regular(found: os.stat_result, path: Path, what: str, most: int | None, refusal: type[RigError]) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = KINDS.get(stat.S_IFMT(found.st_mode), "no file")
        raise refusal(f"{path}: is {kind}, but a {what} must be a regular file; write it to one and give its path")
    if most is not None and found.st_size > most:
        raise refusal(f"{path}: has {found.st_size} bytes, but a {what} has at most {most}; is it another file?")
