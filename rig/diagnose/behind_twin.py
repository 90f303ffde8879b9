"""The recordings behind a twin, found again: with them is told whether what a new run shows is new."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import RecordingError

if TYPE_CHECKING:
    from identification.recording import Recording
    from identification.twin import Source, Twin

NOT_FOUND = (
    "Whether what was found is new was not asked: {} behind the twin, is not beside it and not beside what was "
    "diagnosed; give it with --before."
)


def behind(twin: Twin, folders: Iterable[Path], given: Sequence[Path] = ()) -> list[Recording]:
    """All recordings behind the twin, by name in `folders` and as `given`; none where one is missing or is another.

    Raises RecordingError for a file that was given and is none of them.
    """
    from rig.hdf5 import load

    known = {source.sha256: source for source in twin.sources if source.sha256}
    found = {}
    for path in given:
        hashed = _sha256(path)
        if hashed not in known:
            raise RecordingError(
                f"{path} is none of the recordings behind the twin (its hash is none of theirs); "
                f"expected {', '.join(map(_name, twin.sources))}"
            )
        found[hashed] = path
    places = list(dict.fromkeys(folders))
    for hashed, source in known.items():
        paths = [place / source.file for place in places if source.file]
        here = next((path for path in paths if path.is_file() and _sha256(path) == hashed), None)
        if here is not None:
            found.setdefault(hashed, here)
    if len(found) < len(twin.sources):
        return []
    return [load(found[source.sha256]) for source in twin.sources]


def missing(twin: Twin) -> str:
    """A note that they were not there."""
    return NOT_FOUND.format(", ".join(map(_name, twin.sources)) + ",")


def _name(source: Source) -> str:
    return source.file or source.recording_id


def _sha256(path: Path) -> str:
    """Raises RecordingError."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise RecordingError(f"{path} can't be read ({error.strerror}); give a recording behind the twin") from error
