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
from rig.regular_file import read

MOST_BYTES = 2**30
"""Of a file to import: a day of ten columns at 100 Hz. What is longer is imported in parts."""


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
        data, imported = _converted(source, plan, given)
        attributes = _attributes(source, data, plan, imported, notes)
    else:
        plans = (plan, beside.plan)
        own, its = ({k: v for k, v in given.items() if k in parameters_known(p)} for p in plans)
        own |= {name: value for name, value in given.items() if name not in its}  # unknown to both: refused by name
        data, first = _converted(source, plan, own)
        more, second = _converted(beside.source, beside.plan, its)
        offset = offset_between(first, second, beside.offset)
        imported = merged(first, second, offset, (source.name, beside.source.name))
        attributes = _attributes(source, data, plan, imported, notes, more) | _attributes_beside(beside, more)
    _finish(out, attributes, imported)
    return Summary(out, imported.rows, imported.bad, (*imported.notes, *imported.warnings))


def _refuse_to_overwrite(out: Path) -> None:
    if out.exists():
        raise RecordingError(f"{out} exists; a recording is never overwritten: give another name")


def read_source(source: Path, form: FileMap | None = None) -> bytes:
    """Raises RecordingError for a file that is not there, and for one that is no text where one is expected: what it is
    and what to do."""
    try:
        data = read(source, "file to import", MOST_BYTES, RecordingError)
    except FileNotFoundError as error:
        raise RecordingError(f"{source} can't be read: {error.strerror}") from error
    text = form is None or form.kind == "text"
    what = foreign(data, source.name, form.encoding if form else "utf-8") if text else ""
    if what:
        raise RecordingError(f"{source.name}: {what.replace('FILE', source.name)}")
    return data


def _converted(source: Path, plan: ImportMap, given: Mapping[str, float]) -> tuple[bytes, Imported]:
    data = read_source(source, plan.file)
    try:
        return data, convert(data, plan, given)
    except RigError as error:
        raise type(error)(f"{source.name}: {error}") from error


def _finish(out: Path, attributes: Mapping[str, Attribute], imported: Imported) -> None:
    part = out.with_name(out.name + ".part")
    part.unlink(missing_ok=True)
    _write(part, attributes, imported)
    part.rename(out)


def import_plain(source: Path, out: Path, notes: str = "") -> Summary:
    """Write `out`, a new file, from JSON in the words of the recording format (`rig.importing.json_recording`)."""
    _refuse_to_overwrite(out)
    data = read_source(source)
    try:
        plain = read_plain(data)
    except RecordingError as error:
        raise RecordingError(f"{source.name}: {error}") from error
    digest = hashlib.sha256(data).hexdigest()
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
    source: Path, data: bytes, plan: ImportMap, imported: Imported, notes: str, beside: bytes = b""
) -> dict[str, Attribute]:
    """Root attributes. The id follows from files, maps and parameters: the same import has the same id."""
    digest = hashlib.sha256(data).hexdigest()
    other = [hashlib.sha256(beside).hexdigest()] if beside else []
    identity = "\n".join([digest, plan.text, plan.thruster, plan.kind, *imported.notes, *other])
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


def _attributes_beside(beside: Beside, data: bytes) -> dict[str, Attribute]:
    return {
        "imported_with": beside.source.name,
        "imported_with_sha256": hashlib.sha256(data).hexdigest(),
        "import_map_with": beside.plan.text,
    }


def _version() -> str:
    try:
        return version("thruster-rig")
    except PackageNotFoundError:
        return "(not installed)"
