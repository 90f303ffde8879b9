"""One table or log of another program becomes one recording."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from rig.errors import RecordingError, RigError
from rig.importing.convert import Imported, convert, parameters_known
from rig.importing.json_recording import read_plain
from rig.importing.mapping import FileMap, ImportMap
from rig.importing.reading.foreign_formats import foreign
from rig.importing.timing.two_clocks import ESTIMATED, merged, offset_between
from rig.link.recorder_messages import Attribute, EventRow, Rows
from rig.regular_file import beginning, read

MOST_BYTES = 2**30
"""Of a text to import: a day of ten columns at 100 Hz. What is longer is imported in parts. Of other files only what
the map asks for is kept."""
WHAT = "file to import"


@dataclass(frozen=True, slots=True)
class Summary:
    """What `import_file` did."""

    path: Path
    rows: int
    """Rows of the file that were good."""
    bad: int
    sentences: tuple[str, ...]
    """Assumptions and what was left out; the same as the events of the recording."""


@dataclass(frozen=True, slots=True)
class Beside:
    """A second file with a clock of its own, to be in the same recording."""

    source: Path
    plan: ImportMap
    offset: str | float = ESTIMATED
    """Seconds from the first row of the first file to that of this one; `auto`: estimated; `clock`: by their stamps."""


def import_file(
    source: Path,
    plan: ImportMap,
    out: Path,
    overrides: Mapping[str, float] | None = None,
    notes: str = "",
    beside: Beside | None = None,
) -> Summary:
    """Write `out`, a new file, from `source`. Raises ConfigError or RecordingError; then there is no `out`."""
    _refuse_to_overwrite(out)
    given = dict(overrides or {})
    if beside is None:
        digest, imported = _converted(source, plan, given)
        attributes = _attributes(source, digest, plan, imported, notes)
    else:
        plans = (plan, beside.plan)
        own, its = ({k: v for k, v in given.items() if k in parameters_known(p)} for p in plans)
        own |= {name: value for name, value in given.items() if name not in its}  # unknown to both: refused by name
        digest, first = _converted(source, plan, own)
        more, second = _converted(beside.source, beside.plan, its)
        offset = offset_between(first, second, beside.offset)
        imported = merged(first, second, offset, (source.name, beside.source.name))
        attributes = _attributes(source, digest, plan, imported, notes, more) | _attributes_beside(beside, more)
    _finish(out, attributes, imported)
    return Summary(out, imported.rows, imported.bad, (*imported.notes, *imported.warnings))


def _refuse_to_overwrite(out: Path) -> None:
    if out.exists():
        raise RecordingError(f"{out} exists; a recording is never overwritten: give another name")


def read_source(source: Path, form: FileMap | None = None) -> bytes | Path:
    """The bytes of a text; where a file that is none is expected, the file itself. Raises RecordingError for one that
    is not there, and for one that is no text where one is expected: what it is and what to do."""
    text = form is None or form.kind == "text"
    try:
        if not text:
            beginning(source, WHAT, 1, RecordingError)
            return source
        data = read(source, WHAT, MOST_BYTES, RecordingError)
    except FileNotFoundError as error:
        raise RecordingError(f"{source} can't be read: {error.strerror}") from error
    what = foreign(data, source.name, form.encoding if form else "utf-8")
    if what:
        raise RecordingError(f"{source.name}: {what.replace('FILE', source.name)}")
    return data


def _converted(source: Path, plan: ImportMap, given: Mapping[str, float]) -> tuple[str, Imported]:
    """SHA-256 of the file, and what is in it."""
    content = read_source(source, plan.file)
    try:
        return _digest(content), convert(content, plan, given)
    except RigError as error:
        raise type(error)(f"{source.name}: {error}") from error


def _digest(content: bytes | Path) -> str:
    if isinstance(content, bytes):
        return hashlib.sha256(content).hexdigest()
    with content.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _finish(out: Path, attributes: Mapping[str, Attribute], imported: Imported) -> None:
    part = out.with_name(out.name + ".part")
    part.unlink(missing_ok=True)
    _write(part, attributes, imported)
    part.rename(out)


def import_plain(source: Path, out: Path, notes: str = "") -> Summary:
    """Write `out`, a new file, from JSON in the words of the recording format (`rig.importing.json_recording`)."""
    _refuse_to_overwrite(out)
    data = read_source(source)
    assert isinstance(data, bytes)
    try:
        plain = read_plain(data)
    except RecordingError as error:
        raise RecordingError(f"{source.name}: {error}") from error
    digest = _digest(data)
    attributes: dict[str, Attribute] = {
        "recording_id": str(uuid.uuid5(uuid.NAMESPACE_OID, digest)),
        "thruster": source.stem,
        "software": f"thruster-rig {_version()}, rig import",
        "imported_from": source.name,
        "imported_sha256": digest,
    }
    _finish(out, attributes | plain.attributes | ({"notes": notes} if notes else {}), plain.imported)
    return Summary(out, plain.imported.rows, 0, plain.imported.notes)


def _write(path: Path, attributes: Mapping[str, Attribute], imported: Imported) -> None:
    from rig.hdf5 import RecordingFile  # h5py only where a file is written

    file = RecordingFile(path, attributes, [stream.spec for stream in imported.streams], t0_ns=0)
    for index, stream in enumerate(imported.streams):
        t_ns = np.rint(stream.time * 1e9).astype(np.int64)
        file.add_rows(Rows(index, t_ns, stream.values))
    for step in imported.steps:
        file.add_step(step)
    for text in imported.notes:
        file.add_event(EventRow(0.0, "info", text))
    for text in imported.warnings:
        file.add_event(EventRow(0.0, "warning", text))
    file.close("completed", "imported", 0.0)


def _attributes(
    source: Path, digest: str, plan: ImportMap, imported: Imported, notes: str, *beside: str
) -> dict[str, Attribute]:
    """Root attributes. The id follows from files, maps and parameters: the same import has the same id."""
    identity = "\n".join([digest, plan.text, plan.thruster, plan.kind, *imported.notes, *beside])
    found: dict[str, Attribute] = {
        "recording_id": str(uuid.uuid5(uuid.NAMESPACE_OID, identity)),
        "thruster": plan.thruster or source.stem,
        "kind": plan.kind,
        "created": imported.created,
        "facility": plan.facility,
        "notes": notes,
        "software": f"thruster-rig {_version()}, rig import",
        "imported_from": source.name,
        "imported_sha256": digest,
        "imported_origin": plan.origin,
        "import_map": plan.text,
    }
    return found if plan.water_density is None else found | {"water_density": plan.water_density}


def _attributes_beside(beside: Beside, digest: str) -> dict[str, Attribute]:
    return {
        "imported_with": beside.source.name,
        "imported_with_sha256": digest,
        "import_map_with": beside.plan.text,
    }


def _version() -> str:
    try:
        return version("thruster-rig")
    except PackageNotFoundError:
        return "(not installed)"
