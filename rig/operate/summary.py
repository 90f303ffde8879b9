"""What a campaign gives at its end: a table of the fits, and where the files are."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import click
from rich.table import Table

from identification.thruster.thrust import ThrustFit
from identification.thruster.thrust_report import misfit
from rig.errors import RecordingError
from rig.fit.command import Answer, answer_json, fit_files
from rig.visible_text import console

FIT_FILE = "fits.json"
WIDTH = 80
"""Columns that the table needs; a narrower terminal folds its lines rather than its cells."""


def print_summary(recordings: Sequence[Path], folder: Path) -> None:
    """Fit every recording that allows it, print the table, write fits.json beside the recordings."""
    answers: list[Answer] = []
    told: list[tuple[Answer, Path]] = []
    for path in recordings:
        if not path.exists():
            click.echo(f"{path}: was not written")
            continue
        try:
            found = fit_files([path])
            answers += found
            told += [(answer, path) for answer in found]
        except RecordingError as error:
            click.echo(f"no fit: {error}")
    if answers:
        screen = console()
        screen.width = max(screen.width, WIDTH)
        click.echo("thrust = C V|V| + tare; C in N/V^2, n points, tare and RMSE in N")
        screen.print(table(answers))
        for answer, path in told:
            if wrong := misfit(answer.fit):
                click.echo(f"{answer.fit.thruster or '?'}: {wrong}; next: rig diagnose {path}")
        text = json.dumps(answer_json(answers), indent=1, allow_nan=False)
        (folder / FIT_FILE).write_text(text + "\n", encoding="utf-8")
    click.echo(f"recordings, fits and logs: {folder}")
    for path in recordings:
        click.echo(f"  {path.name}")


def table(answers: Sequence[Answer]) -> Table:
    """One row per thruster, in 80 columns; intervals are those of the t distribution, calibration included."""
    shown = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="bold")
    for heading in ("thruster", "C", "std", "95 % interval", "n", "tare", "RMSE", "chi2/dof"):
        shown.add_column(heading, justify="left" if heading == "thruster" else "right", no_wrap=True)
    for answer in answers:
        shown.add_row(*_row(answer.fit))
    return shown


def _row(fit: ThrustFit) -> tuple[str, ...]:
    C, (tare,) = fit.parameters["C"], fit.tare.values()
    return (
        fit.thruster or "?",
        f"{C.value:.5f}",
        f"{C.std:.5f}",
        f"{C.low:.5f} .. {C.high:.5f}",
        str(fit.estimate.rows.y.size),
        f"{tare.value:.3f}",
        f"{fit.rmse:.3f}",
        "-" if fit.chi2_per_dof is None else f"{fit.chi2_per_dof:.2f}",
    )
