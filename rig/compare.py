"""`rig compare SIM REAL`: what physics a simulation leaves out relative to the real run, whoever wrote it."""

from __future__ import annotations

from pathlib import Path

import click

from rig.diagnose import PATH, read, tell
from rig.errors import RecordingError, RigError


@click.command("compare")
@click.argument("sim", type=PATH)
@click.argument("real", type=PATH)
@click.option("--json", "json_path", type=PATH, help="Write the diagnosis here; - is standard output.")
@click.option(
    "--report", type=click.Path(dir_okay=False, path_type=Path), help="Write a page with figures here (HTML)."
)
@click.option("--seed", default=0, show_default=True, help="Of the surrogates that the false-alarm rate is judged by.")
def compare_command(sim: Path, real: Path, json_path: Path | None, report: Path | None, seed: int) -> None:
    """Diagnose the recording REAL against the recording SIM that any program simulated with the same command.

    Exit status 0 for every honest verdict, 2 for input that cannot be used (one sentence why).
    """
    from identification.mismatch.comparing import compare
    from identification.mismatch.preparing import Refusal

    try:
        simulation, measured = read([sim, real])
        found = compare(simulation, measured, seed)
        if isinstance(found, Refusal):
            raise RecordingError(found.reason)
        tell(found.real, json_path, report, None)
    except (RigError, OSError) as error:
        click.echo(f"rig compare: {error}", err=True)
        raise SystemExit(2) from error
