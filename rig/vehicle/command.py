"""`rig vehicle FILE... --thrusters FIT.json`: drag, efficiency and inertia of a vehicle from its trials."""

from __future__ import annotations

import json
from pathlib import Path

import click

from rig.errors import RigError
from rig.list_option import ListCommand, ListOption
from rig.result_path import RESULT, RESULT_FILE
from rig.vehicle.answer import identify_files
from rig.vehicle.text import answer_json, answer_text


@click.command("vehicle", cls=ListCommand)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--thrusters",
    multiple=True,
    type=click.Path(path_type=Path),
    help="What `rig fit --json` wrote of the vehicle's thrusters.",
)
@click.option("--installation", type=click.Path(path_type=Path), help="Which thruster sits where (TOML).")
@click.option("--json", "json_path", type=RESULT, help="Write the answer here; - is standard output.")
@click.option("--report", type=RESULT_FILE, help="Write a page with figures here (HTML).")
@click.option(
    "--holdout",
    cls=ListOption,
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE...",
    help="Recordings to simulate that are not fitted: every file up to the next option (may be repeated).",
)
@click.option(
    "--comparators", is_flag=True, help="Derivative, Kalman and annealing estimates of the inertia beside ours."
)
def vehicle_command(
    files: tuple[Path, ...],
    thrusters: tuple[Path, ...],
    installation: Path | None,
    json_path: Path | None,
    report: Path | None,
    holdout: tuple[Path, ...],
    comparators: bool,
) -> None:
    """Identify drag, thruster efficiency, current, buoyancy and inertia from trials of a vehicle in the water.

    FILES are recordings of kind vehicle, or folders of them.
    """
    try:
        answer = identify_files(files, thrusters, installation, holdout, comparators)
        text = json.dumps(answer_json(answer), indent=1, allow_nan=False)
        if json_path is not None and str(json_path) != "-":
            json_path.write_text(text + "\n", encoding="utf-8")
        if report is not None:
            from rig.vehicle.report.page import (
                write_report,  # matplotlib takes a second to come up: only where it is used
            )

            write_report(answer, report)
    except (RigError, OSError) as error:
        click.echo(f"rig vehicle: {error}", err=True)
        raise SystemExit(2) from error
    click.echo(text if json_path is not None and str(json_path) == "-" else answer_text(answer))
