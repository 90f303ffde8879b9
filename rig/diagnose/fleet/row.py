"""The diagnosis of one recording as a row of a table. It knows no engine."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from identification.mismatch.answer.as_json import diagnosis_json
from identification.mismatch.diagnosis import Diagnosis
from rig.diagnose.command import diagnose_files
from rig.errors import RecordingError, RigError, UnreadError
from rig.fleet.columns import COMMON, Column
from rig.fleet.files import sha256_of
from rig.fleet.question import Question, Row
from rig.hdf5 import headers
from rig.hdf5.opening import require_file
from rig.twin.reading import read_twin
from rig.workers.version import version_of

PARAMETER: Final = (
    Column("name"),
    Column("value", "number"),
    Column("std", "number"),
    Column("low", "number"),
    Column("high", "number"),
    Column("unit"),
)
FINDING: Final = (
    Column("effect"),
    Column("form"),
    Column("statement"),
    Column("grade"),
    Column("p_value", "number"),
    Column("probability", "number"),
    Column("share", "number"),
    Column("in_measurement", "truth"),
    Column("parameters", "structures", parts=PARAMETER),
    Column("rivals", "texts"),
    Column("doubts", "texts"),
)
COLUMNS: Final = (
    *COMMON,
    Column("verdict"),
    Column("headline"),
    Column("statement"),
    Column("baseline"),
    Column("parameters", "structures", parts=PARAMETER),
    Column("findings", "structures", parts=FINDING),
    Column("response"),
    Column("unit"),
    Column("rmse_before", "number"),
    Column("rmse_after", "number"),
    Column("heldout_before", "number"),
    Column("heldout_after", "number"),
    Column("chi2_per_dof", "number"),
    Column("whiteness_p", "number"),
    Column("notes", "texts"),
)
"""`parameters` of the final model; errors in `unit`."""


@cache
def version() -> str:
    """Of the sources that have a say in a row."""
    import identification
    import rig.diagnose
    import rig.fleet
    import rig.hdf5

    return version_of(identification, rig.hdf5, rig.diagnose, rig.fleet)


def question_of(seed: int, twin: Path | None = None, *, any_thruster: bool = False) -> Question:
    """What `rig diagnose` with this seed, against this twin, asks of each file. Raises RecordingError for no twin."""
    options: dict[str, Any] = {"seed": seed}
    if twin is not None:
        require_file(twin)
        read_twin(twin)  # one that is none is told once, and not of every file
        options |= {"twin": str(twin.absolute()), "twin_sha256": sha256_of(twin), "any_thruster": any_thruster}
    return Question("diagnoses", "rig.diagnose.fleet.row:answer", options, version())


def answer(path: Path, options: Mapping[str, Any]) -> Row:
    """The row of the recording in `path`, diagnosed alone; with an `error` where it can't be.

    Raises RecordingError for what is no recording, UnreadError.
    """
    (header,) = headers([path])
    if isinstance(header, RigError):
        raise header
    whose = {name: header.texts.get(name, "") for name in ("thruster", "recording_id", "created")}
    try:
        twin = _twin(options)
        found = diagnose_files([path], (), options["seed"], twin, any_thruster=bool(options.get("any_thruster")))
        return whose | _said(found)
    except UnreadError:
        raise
    except RigError as error:
        return whose | {"error": str(error)}


def _twin(options: Mapping[str, Any]) -> Path | None:
    """The one that was asked about, and no other that has its name by now. Raises RecordingError."""
    if "twin" not in options:
        return None
    twin = Path(options["twin"])
    require_file(twin)
    if sha256_of(twin) != options["twin_sha256"]:
        raise RecordingError(f"{twin} is not the twin that was asked about: its contents changed; ask again")
    return twin


def _said(found: Diagnosis) -> Row:
    known: Any = diagnosis_json(found)
    train, held = known["fit"]["train"], known["fit"]["heldout"]
    return {
        "verdict": known["verdict"],
        "headline": known["headline"],
        "statement": known["statement"],
        "baseline": known["baseline"]["model"],
        "parameters": _parameters(known["model"]["parameters"]),
        "findings": [_finding(each) for each in known["findings"]],
        "response": known["response"]["quantity"],
        "unit": known["response"]["unit"],
        "rmse_before": train["rmse_before"],
        "rmse_after": train["rmse_after"],
        "heldout_before": held["rmse_before"],
        "heldout_after": held["rmse_after"],
        "chi2_per_dof": known["fit"]["chi2_per_dof"],
        "whiteness_p": known["fit"]["whiteness_p"],
        "notes": known["notes"],
    }


def _finding(known: Mapping[str, Any]) -> Row:
    said = {column.name: known[column.name] for column in FINDING}
    return said | {"parameters": _parameters(known["parameters"])}


def _parameters(known: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    return [{"name": name} | {c.name: v[c.name] for c in PARAMETER[1:]} for name, v in known.items()]
