"""`rig import`: a table or log of another program becomes a recording."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Literal

import click
import numpy as np

from rig.errors import ConfigError, RecordingError, RigError
from rig.importing.convert import Imported, convert
from rig.importing.json_recording import read_plain
from rig.importing.mapping import ImportMap, read_map, shipped
from rig.link.recorder_messages import Attribute, EventRow, Rows


@dataclass(frozen=True, slots=True)
class Summary:
    """What `import_file` did."""

    path: Path
    rows: int
    """Rows of the file that were good."""
    bad: int
    sentences: tuple[str, ...]
    """Assumptions and what was left out; the same as the events of the recording."""


def import_file(
    source: Path, plan: ImportMap, out: Path, overrides: Mapping[str, float] | None = None, notes: str = ""
) -> Summary:
    """Write `out`, a new file, from `source`. Raises ConfigError or RecordingError; then there is no `out`."""
    if out.exists():
        raise RecordingError(f"{out} exists; a recording is never overwritten: give another name")
    try:
        data = source.read_bytes()
    except OSError as error:
        raise RecordingError(f"{source} can't be read: {error.strerror}") from error
    try:
        imported = convert(data, plan, overrides or {})
    except RigError as error:
        raise type(error)(f"{source.name}: {error}") from error
    part = out.with_name(out.name + ".part")
    part.unlink(missing_ok=True)
    _write(part, _attributes(source, data, plan, imported, notes), imported)
    part.rename(out)
    return Summary(out, imported.rows, imported.bad, (*imported.notes, *imported.warnings))


def import_plain(source: Path, out: Path, notes: str = "") -> Summary:
    """Write `out`, a new file, from JSON in the words of the recording format (`rig.importing.json_recording`)."""
    if out.exists():
        raise RecordingError(f"{out} exists; a recording is never overwritten: give another name")
    try:
        data = source.read_bytes()
        plain = read_plain(data)
    except OSError as error:
        raise RecordingError(f"{source} can't be read: {error.strerror}") from error
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
    part = out.with_name(out.name + ".part")
    part.unlink(missing_ok=True)
    _write(part, attributes | plain.attributes | ({"notes": notes} if notes else {}), plain.imported)
    part.rename(out)
    return Summary(out, plain.imported.rows, 0, plain.imported.notes)


def _write(path: Path, attributes: Mapping[str, Attribute], imported: Imported) -> None:
    from rig.hdf5 import RecordingFile  # h5py only where a file is written: rig.cli imports this module always

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


def _attributes(source: Path, data: bytes, plan: ImportMap, imported: Imported, notes: str) -> dict[str, Attribute]:
    """Root attributes. The id follows from file, map and parameters: the same import has the same id."""
    digest = hashlib.sha256(data).hexdigest()
    identity = "\n".join([digest, plan.text, plan.thruster, plan.kind, *imported.notes])
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


def _version() -> str:
    try:
        return version("thruster-rig")
    except PackageNotFoundError:
        return "(not installed)"


def _assignments(texts: tuple[str, ...]) -> dict[str, float]:
    """`name=value` of --set.

    >>> _assignments(("nominal_voltage=48",))
    {'nominal_voltage': 48.0}
    """
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError as error:
            raise ConfigError(f"--set {text}: expected name=number, for example nominal_voltage=48") from error
    return found


def _refuse_without_map(file: Path, options: Mapping[str, object]) -> None:
    """Raises ConfigError where an option was given that changes a map."""
    given = [name for name, value in options.items() if value]
    if given:
        raise ConfigError(f"{file}: {', '.join(given)} is for a map: give --map, or write it into the JSON itself")


def _list_maps(context: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        for name in shipped():
            click.echo(f"{name:28} {read_map(name).about}")
        context.exit()


@click.command("import", help="Make a recording of another program's table or log, as MAP says what its columns are.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--map",
    "map_name",
    help="name of a shipped map (see --list) or path of a MAP.toml; none for JSON in the words of the recording format",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), help="the recording; default: FILE with .h5")
@click.option("--set", "assignments", multiple=True, metavar="NAME=NUMBER", help="override a parameter of the map")
@click.option("--thruster", help="id of the thruster; default: the map's, else the file's name")
@click.option("--kind", type=click.Choice(["tunnel", "bollard", "vehicle"]), help="override the map's kind")
@click.option("--notes", default="", help="kept in the recording")
@click.option("--list", is_flag=True, is_eager=True, expose_value=False, callback=_list_maps, help="list shipped maps")
def import_command(
    *,
    file: Path,
    map_name: str | None,
    output: Path | None,
    assignments: tuple[str, ...],
    thruster: str | None,
    kind: Literal["tunnel", "bollard", "vehicle"] | None,
    notes: str,
) -> None:
    """Exit status 0; RigError is for the caller (rig.cli) to print."""
    if map_name is None:
        _refuse_without_map(file, {"--set": assignments, "--thruster": thruster, "--kind": kind})
        summary = import_plain(file, output or file.with_suffix(".h5"), notes)
        click.echo(f"{summary.path}: {summary.rows} rows")
        return
    plan = read_map(map_name)
    plan = replace(plan, thruster=thruster or plan.thruster, kind=kind or plan.kind)
    summary = import_file(file, plan, output or file.with_suffix(".h5"), _assignments(assignments), notes)
    for sentence in summary.sentences:
        click.echo(sentence)
    click.echo(f"{summary.path}: {summary.rows} rows, {summary.bad} left out")
