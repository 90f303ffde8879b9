"""What a report rests on: which recordings, as files that can be recognised."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.hdf5 import load
from rig.report.page import Section, Table, columns, program

BLOCK = 1 << 20


@dataclass(frozen=True, slots=True)
class Source:
    """One file that was read."""

    name: str
    recording_id: str
    thruster: str
    created: str
    outcome: str
    sha256: str


def sources(paths: Iterable[Path]) -> tuple[Source, ...]:
    """Identity and hash of each recording; a folder stands for every `*.h5` in it. Raises RecordingError, OSError."""
    files: list[Path] = []
    for path in paths:
        files += sorted(path.glob("*.h5")) if path.is_dir() else [path]
    return tuple(_source(path) for path in files)


def _source(path: Path) -> Source:
    recording = load(path)
    outcome = recording.outcome or ("complete" if recording.complete else "not closed in order")
    return Source(path.name, recording.recording_id, recording.thruster, recording.created, outcome, sha256(path))


def sha256(path: Path) -> str:
    """Of a file's bytes, in hexadecimal."""
    found = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            found.update(block)
    return found.hexdigest()


def section(found: Sequence[Source], recordings: Sequence[str] = ()) -> Section:
    """`recordings`: ids to list where the files are not at hand."""
    lead = f"Computed by {program()}."
    if found:
        head = ("file", "thruster", "recorded", "ended", "recording id", "SHA-256 of the file")
        rows = tuple((s.name, s.thruster, s.created, s.outcome, s.recording_id, s.sha256) for s in found)
        return Section("Provenance", (Table("Recordings behind this page", head, rows, columns(head, *head)),), lead)
    listed = Table("Recordings behind this page", ("recording id",), tuple((name,) for name in recordings))
    return Section("Provenance", (listed,), lead)
