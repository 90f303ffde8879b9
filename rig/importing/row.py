"""The import of one file as a row of a table: `rig import --jobs`. It knows no engine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any, Final

from rig.errors import ConfigError, RecordingError, RigError
from rig.fleet.columns import COMMON, Column
from rig.fleet.question import Question, Row
from rig.hdf5.header import headers
from rig.importing.map_options import Levels, plan_of
from rig.importing.mapping import ImportMap
from rig.importing.one_file import import_file
from rig.importing.thruster_name import thruster_of
from rig.workers.version import version_of

COLUMNS: Final = (
    *COMMON,
    Column("recording"),
    Column("kind"),
    Column("known_by"),
    Column("rows", "whole"),
    Column("left_out", "whole"),
    Column("sentences", "texts"),
)
"""`recording`: the path that was written; `known_by`: how the thruster is known; `left_out`: rows of the file."""


@cache
def version() -> str:
    """Of the sources that have a say in a row."""
    import rig.fleet
    import rig.hdf5
    import rig.importing

    return version_of(rig.hdf5, rig.importing, rig.fleet)


def question_of(
    map_name: str,
    folder: Path | None,
    *,
    levels: Levels | None = None,
    where: str = "",
    parameters: Mapping[str, float] | None = None,
    thruster: str | None = None,
    kind: str | None = None,
    notes: str = "",
) -> Question:
    """What `rig import` with these options asks of each file; recordings go to `folder`, or beside the file.

    Raises ConfigError for what is no map.
    """
    plan = plan_of(map_name, levels, where)
    options = {
        "map": str(Path(map_name).absolute()) if Path(map_name).is_file() else map_name,
        "map_sha256": _digest(plan),
        "folder": None if folder is None else str(folder.absolute()),
        "levels": levels,
        "where": where,
        "set": dict(parameters or {}),
        "thruster": thruster,
        "kind": kind,
        "notes": notes,
    }
    return Question("imports", "rig.importing.row:answer", options, version())


def answer(path: Path, options: Mapping[str, Any]) -> Row:
    """The row of the recording that the file in `path` became; one that was there before is as good as that, if it is
    the same import. Raises RigError for a file that can't be imported."""
    plan = plan_of(options["map"], options["levels"], options["where"])
    if _digest(plan) != options["map_sha256"]:
        raise ConfigError(f"{options['map']} is not the map that was asked with: its contents changed; ask again")
    whose, known_by = thruster_of(options["thruster"], plan, path)
    plan = replace(plan, thruster=whose, kind=options["kind"] or plan.kind)
    out = recording_of(str(path), options["folder"])
    with TemporaryDirectory(prefix="rig-import-") as aside:
        before = out if out.exists() else None
        made = import_file(path, plan, Path(aside) / out.name if before else out, options["set"], options["notes"])
        identity = _identity(made.path)
        if before is not None and _identity(before) != identity:
            raise RecordingError(f"{before} exists, and is another recording, which is never overwritten: move it away")
    return {
        "thruster": whose,
        "recording_id": identity["recording_id"],
        "created": identity["created"],
        "recording": str(out),
        "kind": plan.kind,
        "known_by": known_by,
        "rows": made.rows,
        "left_out": made.bad,
        "sentences": list(made.sentences),
    }


def recording_of(url: str, folder: str | None) -> Path:
    """Where the recording of a file goes.

    >>> str(recording_of("/logs/T1.csv", "/data")), str(recording_of("/logs/T1.csv", None))
    ('/data/T1.h5', '/logs/T1.h5')
    """
    name = PurePosixPath(url).with_suffix(".h5")
    return Path(name) if folder is None else Path(folder) / name.name


def _digest(plan: ImportMap) -> str:
    return sha256(plan.text.encode()).hexdigest()


def _identity(path: Path) -> dict[str, str]:
    (header,) = headers([path])
    if isinstance(header, RigError):
        raise header
    return {name: header.texts.get(name, "") for name in ("recording_id", "created")}
