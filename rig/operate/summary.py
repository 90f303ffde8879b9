"""What a campaign gives at its end: a table of the fits, and where the files are."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import click
from rich.table import Table

from identification.recording import Recording
from identification.thruster.thrust import ThrustFit
from identification.thruster.thrust_report import misfit
from rig.errors import RecordingError
from rig.fit.answer import is_driven
from rig.fit.command import Answer, answer_json, fit_recordings
from rig.hdf5 import load
from rig.visible_text import console

FIT_FILE = "fits.json"
WIDTH = 80
"""Columns that the table needs; a narrower terminal folds its lines rather than its cells."""


def print_summary(recordings: Sequence[Path], folder: Path) -> None:
    """Fit every thruster whose recordings allow it, print the table, write fits.json beside the recordings."""
    told = fitted(recordings)
    answers = [answer for answer, _ in told]
    if answers:
        screen = console()
        screen.width = max(screen.width, WIDTH)
        click.echo("thrust = C V|V| + tare; C in N/V^2, n points, tare and RMSE in N")
        screen.print(table(answers))
        for answer, paths in told:
            if wrong := misfit(answer.fit):
                files = " ".join(map(str, paths))
                click.echo(f"{answer.fit.thruster or '?'}: {wrong}; next: rig diagnose {files}")
        text = json.dumps(answer_json(answers), indent=1, allow_nan=False)
        (folder / FIT_FILE).write_text(text + "\n", encoding="utf-8")
    click.echo(f"recordings, fits and logs: {folder}")
    for path in recordings:
        click.echo(f"  {path.name}")


def fitted(paths: Iterable[Path]) -> list[tuple[Answer, list[Path]]]:
    """One answer per thruster, of all its recordings together: a run that was cut and gone on with has several.

    What allows no fit is told, and left out.
    """
    groups: dict[str, list[tuple[Path, Recording]]] = {}
    for path in paths:
        if not path.exists():
            click.echo(f"{path}: was not written")
            continue
        try:
            recording = load(path)
        except RecordingError as error:
            click.echo(f"no fit: {error}")
            continue
        if is_driven(recording):
            groups.setdefault(recording.thruster, []).append((path, recording))
    answers = []
    for group in groups.values():
        try:
            (answer,) = fit_recordings([recording for _, recording in group])
        except RecordingError as error:
            click.echo(f"no fit: {error}")
            continue
        answers.append((answer, [path for path, _ in group]))
    return answers


def table(answers: Sequence[Answer]) -> Table:
    """One row per thruster, in 80 columns; intervals are those of the t distribution, calibration included."""
    shown = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False, header_style="bold")
    for heading in ("thruster", "C", "std", "95 % interval", "n", "tare", "RMSE", "chi2/dof"):
        shown.add_column(heading, justify="left" if heading == "thruster" else "right", no_wrap=True)
    for answer in answers:
        shown.add_row(*_row(answer.fit))
    return shown


def _row(fit: ThrustFit) -> tuple[str, ...]:
    C, tares = fit.parameters["C"], list(fit.tare.values())
    return (
        fit.thruster or "?",
        f"{C.value:.5f}",
        f"{C.std:.5f}",
        f"{C.low:.5f} .. {C.high:.5f}",
        str(fit.estimate.rows.y.size),
        f"{tares[0].value:.3f}" if len(tares) == 1 else f"{len(tares)} of them",
        f"{fit.rmse:.3f}",
        "-" if fit.chi2_per_dof is None else f"{fit.chi2_per_dof:.2f}",
    )
