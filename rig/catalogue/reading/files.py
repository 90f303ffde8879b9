"""The files that a catalogue is about: found by name, told from their former selves by size and time of change."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

RECORDINGS: Final = (".h5", ".hdf5")
DOCUMENTS: Final = (".json",)
LEDGER: Final = "campaign.jsonl"


class Stamp(NamedTuple):
    """What changes when a file does."""

    size: int
    """Bytes; -1 where there is no regular file of the name."""
    mtime_ns: int


def found(folder: Path) -> dict[str, Stamp]:
    """Path below `folder`, with slashes, to stamp. Folders that begin with a dot or are links are not entered."""
    return dict(_found(str(folder), ""))


def _found(folder: str, below: str) -> Iterator[tuple[str, Stamp]]:
    try:
        with os.scandir(folder) as scan:
            entries = list(scan)
    except OSError:
        return  # not ours to read, or gone meanwhile
    for entry in entries:
        path = below + entry.name
        if entry.name.endswith((*RECORDINGS, *DOCUMENTS)) or entry.name == LEDGER:
            stamp = _stamp(entry)
            if stamp is not None:
                yield path, stamp
        elif not entry.name.startswith(".") and _is_folder(entry):
            yield from _found(entry.path, path + "/")


def _stamp(entry: os.DirEntry[str]) -> Stamp | None:
    """None for a folder."""
    try:
        status = entry.stat()
    except OSError:
        return Stamp(-1, 0)
    if stat.S_ISDIR(status.st_mode):
        return None
    return Stamp(status.st_size, status.st_mtime_ns) if stat.S_ISREG(status.st_mode) else Stamp(-1, 0)


def _is_folder(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir(follow_symlinks=False)
    except OSError:
        return False
