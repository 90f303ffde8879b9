"""`rig compare SIM REAL`: what physics a simulation leaves out relative to the real run, whoever wrote it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.diagnose.command import NOTHING, read, recordings_in, refuse_both, tell
from rig.diagnose.outputs import PATH, Wanted, answer_options, holdout_option, seed_option, wanted_of
from rig.diagnose.progress import observed
from rig.errors import RecordingError, RigError
from rig.list_option import ListCommand

if TYPE_CHECKING:
    from identification.mismatch.comparison import Compared
    from identification.mismatch.observer import Observer


def compare_files(
    sim: Path,
    real: Path,
    holdout: Iterable[Path] = (),
    seed: int = 0,
    wanted: Wanted = NOTHING,
    observer: Observer | None = None,
) -> Compared:
    """The real recording diagnosed against the simulated one; its twin knows the hashes of both files.

    `holdout`: further real runs, which are only predicted. `observer` as for diagnose_files(). Raises RecordingError or
    ConfigError for what cannot be used.
    """
    from identification.mismatch.comparison import compare
    from identification.mismatch.observer import UNWATCHED
    from identification.mismatch.prepare.preparing import Refusal
    from rig.twin.writing import stamped

    held = recordings_in(holdout, "rig compare") if holdout else []
    refuse_both([sim, real], held)
    simulation, measured = read([sim, real])
    wanted.refuse([measured])
    found = compare(simulation, measured, seed, read(held), wanted.limits, observer or UNWATCHED)
    if isinstance(found, Refusal):
        raise RecordingError(found.reason)
    if found.real.twin is None:
        return found
    twin = stamped(found.real.twin, {simulation.recording_id: sim, measured.recording_id: real})
    return replace(found, real=replace(found.real, twin=twin))


@click.command("compare", cls=ListCommand)
@click.argument("sim", type=PATH)
@click.argument("real", type=PATH)
@holdout_option
@answer_options
@seed_option
def compare_command(sim: Path, real: Path, holdout: tuple[Path, ...], seed: int, **outputs: Any) -> None:
    """Diagnose the recording REAL against the recording SIM that any program simulated with the same command.

    Ctrl+C ends the search with what it has, and the answer says what was not asked; a second time ends at once.

    Exit status 0 for every honest verdict, 2 for input that cannot be used (one sentence why), 130 if ended at once.
    """
    try:
        wanted = wanted_of(**outputs)
        with observed(shown=not wanted.alone) as observer:
            found = compare_files(sim, real, holdout, seed, wanted, observer)
        tell(found.real, wanted, [found.recording], (sim, real, *holdout))
    except (RigError, OSError) as error:
        click.echo(f"rig compare: {error}", err=True)
        raise SystemExit(2) from error
