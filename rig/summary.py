"""What a campaign gives at its end: a table of the fits, and where the files are."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from identification.thrust_report import sentence
from rig.errors import RecordingError
from rig.fit import Answer, answer_json, fit_files

FIT_FILE = "fits.json"


def print_summary(recordings: Sequence[Path], folder: Path) -> None:
    """Fit every recording that allows it, print the table, write fits.json beside the recordings."""
    answers: list[Answer] = []
    for path in recordings:
        if not path.exists():
            click.echo(f"{path}: was not written")
            continue
        try:
            answers += fit_files([path])
        except RecordingError as error:
            click.echo(f"no fit: {error}")
    if answers:
        Console().print(_table(answers))
        for answer in answers:
            click.echo(sentence(answer.fit))
        text = json.dumps(answer_json(answers), indent=1, allow_nan=False)
        (folder / FIT_FILE).write_text(text + "\n", encoding="utf-8")
    click.echo(f"recordings, fits and logs: {folder}")
    for path in recordings:
        click.echo(f"  {path.name}")


def _table(answers: Sequence[Answer]) -> Table:
    table = Table(title="tau = C V|V|, one row per thruster")
    for heading in (
        "thruster",
        "C [N/V^2]",
        "std. error",
        "95 % interval",
        "points",
        "tare [N]",
        "RMSE [N]",
        "chi2/dof",
    ):
        table.add_column(heading, justify="left" if heading == "thruster" else "right")
    for answer in answers:
        fit = answer.fit
        C, (tare,) = fit.parameters["C"], fit.tare.values()
        chi2 = "-" if fit.chi2_per_dof is None else f"{fit.chi2_per_dof:.2f}"
        interval = f"{C.low:.5f} .. {C.high:.5f}"
        table.add_row(
            fit.thruster,
            f"{C.value:.5f}",
            f"{C.std:.5f}",
            interval,
            str(fit.estimate.rows.y.size),
            f"{tare.value:.3f}",
            f"{fit.rmse:.3f}",
            chi2,
        )
    return table
