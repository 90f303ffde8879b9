"""`rig recover`: a plain copy of a recording whose writer was killed, and its loss in samples."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("recover", help="Copy a recording that was not closed in order into a plain file; FILE is not changed.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="default: FILE with -recovered before .h5")
def recover_command(file: Path, output: Path | None) -> None:
    """Exit status 0; RigError is for the caller (rig.cli) to print."""
    from rig.hdf5 import recover  # h5py only where a file is read
    from rig.hdf5.recover import sentence

    out = output or file.with_name(f"{file.stem}-recovered.h5")
    losses = recover(file, out)
    for loss in losses:
        click.echo(sentence(loss))
    click.echo(f"{out}: {sum(loss.kept for loss in losses)} rows in {len(losses)} streams")
