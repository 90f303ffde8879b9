"""The twin of the unit that is as usual as any: what the others are diagnosed against."""

from __future__ import annotations

from pathlib import Path

from rig.diagnose.command import diagnose_files
from rig.diagnose.fleet.row import question_of
from rig.errors import RecordingError
from rig.fleet.files import at_hand, sha256_of
from rig.names import why_no_name
from rig.twin.writing import write_twin


def twin_of_usual(url: str, thruster: str, store: Path, seed: int) -> Path:
    """Its file in the store, made where this program has not made it yet of these bytes. Raises RigError, OSError."""
    key = question_of(seed).key(sha256_of(url))[:12]
    path = store / "usual" / key / f"{thruster if not why_no_name(thruster) else 'usual'}.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with at_hand(url) as file:
            found = diagnose_files([file], seed=seed)
        if found.twin is None:
            raise RecordingError(f"{url} has no twin, against which the others could be diagnosed: {found.statement}")
        part = path.with_suffix(".part")
        write_twin(found.twin, part)
        part.replace(path)
    return path
