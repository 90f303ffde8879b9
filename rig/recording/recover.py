"""`rig recover`: a plain copy of a recording whose writer was killed, and its loss in samples; and which of the two is
read where both are given."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from rig.errors import RecordingError
from rig.recording.ledger import FILE_NAME, read


@click.command("recover", help="Copy a recording that was not closed in order into a plain file; FILE is not changed.")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The copy (default: FILE with -recovered before .h5)."
)
def recover_command(file: Path, output: Path | None) -> None:
    """Exit status 0; RigError is for the caller (rig.cli) to print."""
    from rig.hdf5 import recover  # h5py only where a file is read
    from rig.hdf5.recover import sentence

    out = output or file.with_name(f"{file.stem}-recovered.h5")
    losses = recover(file, out, end_of(file))
    for loss in losses:
        click.echo(sentence(loss))
    click.echo(f"{out}: {sum(loss.kept for loss in losses)} rows in {len(losses)} streams")


def rather_recovered(paths: Sequence[Path], *, told: bool = True) -> list[Path]:
    """The files without those of which a recovered copy is among them; `told`: each left aside is said on stderr.

    Raises RecordingError for what is no recording.
    """
    if len(paths) < 2:
        return list(paths)
    from rig.hdf5 import identity_of

    found = {path: identity_of(path) for path in paths}
    copies = {name: path for path, (name, opened_as) in found.items() if opened_as == "plain" and name}
    damaged = {path: name for path, (name, opened_as) in found.items() if opened_as != "plain" and name in copies}
    for path, name in damaged.items() if told else ():
        click.echo(f"{path.name} was not closed in order: its recovered copy {copies[name].name} is taken", err=True)
    return [path for path in paths if path not in damaged]


def end_of(file: Path) -> tuple[str, str]:
    """Outcome and cause of the run that a recording is of, by the ledger beside it: a recorder that was killed could
    not write them down, and the controller did. Of a run that no ledger knows the end of: aborted, and no cause."""
    try:
        facts = read(file.parent) if (file.parent / FILE_NAME).exists() else []
    except RecordingError as error:
        click.echo(f"how the run ended is not taken from its ledger: {error}", err=True)
        facts = []
    ends = [fact for fact in facts if fact["fact"] == "run_end" and Path(fact["recording"]).name == file.name]
    outcome, cause = (ends[-1]["outcome"], ends[-1]["cause"]) if ends else ("aborted", "")
    return (outcome, cause) if outcome in ("aborted", "tripped") else ("aborted", cause)
