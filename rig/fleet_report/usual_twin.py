"""The twin of the unit that is as usual as any: what the others are diagnosed against."""

from __future__ import annotations

from pathlib import Path

from rig.diagnose.command import diagnose_files
from rig.diagnose.fleet.row import question_of
from rig.errors import RecordingError
from rig.fleet.files import sha256_of
from rig.twin.writing import write_twin


def twin_of_usual(url: str, store: Path, seed: int) -> Path:
    """Its file in the store, made where this program has not made it yet of these bytes. Raises RigError, OSError."""
    question = question_of(seed)
    path = store / "usual" / f"{question.key(sha256_of(url))[:16]}.json"
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        found = diagnose_files([Path(url)], seed=seed)
        if found.twin is None:
            raise RecordingError(f"{url} has no twin, against which the others could be diagnosed: {found.statement}")
        part = path.with_suffix(".part")
        write_twin(found.twin, part)
        part.replace(path)
    return path
