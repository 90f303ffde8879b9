"""`rig pack FILES...`: packed copies of recordings, in a folder of their own."""

from __future__ import annotations

from pathlib import Path

import click

from rig.errors import RecordingError, RigError

FOLDER = "packed"
"""Beside each file, where no other is given: a folder that held both would hold each recording twice."""


@click.command("pack")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--to",
    "folder",
    type=click.Path(file_okay=False, path_type=Path),
    help=f"Folder of the copies.  [default: {FOLDER}/ beside each file]",
)
def pack_command(files: tuple[Path, ...], folder: Path | None) -> None:
    """Make a packed copy of each recording: smaller, with checksums, quick to read in part.

    A folder stands for its *.h5. The raw files are not changed. What cannot be packed is told, and the others are.

    Exit status 0, 1 where a file was not packed, 2 where none was given.
    """
    from rig.hdf5.archive.pack import pack  # h5py only where a file is read

    paths = [each for file in files for each in (sorted(file.glob("*.h5")) if file.is_dir() else [file])]
    if not paths:
        raise RecordingError(f"rig pack: no recording in {', '.join(map(str, files))}; expected *.h5")
    before = after = bad = 0
    for path in paths:
        try:
            place = folder or path.parent / FOLDER
            place.mkdir(parents=True, exist_ok=True)
            done = pack(path, place / path.name)
        except (RigError, OSError) as error:
            click.echo(f"rig pack: {error}", err=True)
            bad += 1
            continue
        before, after = before + done.before, after + done.after
        click.echo(f"{done.path}: {done.after / 1e6:.2f} of {done.before / 1e6:.2f} MB")
    if len(paths) > 1:
        click.echo(f"{len(paths) - bad} of {len(paths)} recordings packed: {after / 1e6:.1f} of {before / 1e6:.1f} MB")
    if bad:
        raise SystemExit(1)
