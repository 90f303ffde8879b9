"""`rig fit FILE...`: thruster models per thruster, all thrusters compared, and compared with an earlier fit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import click

from identification.estimation import Method
from identification.thrust_data import Unusable
from identification.thrust_forms import Model
from rig.errors import RecordingError, RigError
from rig.fit_answer import Answer, fit_files, fit_recordings
from rig.fit_comparison import alike, changed
from rig.fit_json import answer_json, fit_json
from rig.fit_text import alike_text, answer_text, changed_text, set_text

__all__ = ["Answer", "answer_json", "answer_text", "fit_command", "fit_files", "fit_json", "fit_recordings"]


class Choice(NamedTuple):
    """What a word after `--model` stands for."""

    model: Model
    against: str | None = None
    """The signal it needs; None: what `--against` says."""


NAMES: dict[str, Choice] = {
    "C": Choice("C V|V|"),
    "C V|V|": Choice("C V|V|"),
    "C+/C-": Choice("C+/C-"),
    "C_t n|n|": Choice("C V|V|", "rotation_rate"),
    "C_t+/C_t-": Choice("C+/C-", "rotation_rate"),
    "C V|V| - C_s|V|U": Choice("C V|V| - C_s|V|U"),
    "C+/C- - C_s|V|U": Choice("C+/C- - C_s|V|U"),
    "C_t n|n| - C_s|n|U": Choice("C V|V| - C_s|V|U", "rotation_rate"),
    "C_t+/C_t- - C_s|n|U": Choice("C+/C- - C_s|V|U", "rotation_rate"),
    "flow": Choice("C V|V| - C_s|V|U"),
    "dynamics": Choice("C V|V|", "rotation_rate"),
}
"""What `--model` takes. `flow`: with the flow term; `dynamics`: thrust by rotation rate, and the rotor must be told."""
AGAINST = ("command_voltage", "motor_voltage", "rotation_rate")
"""What `--against` takes."""


def _rotor_told(answers: tuple[Answer, ...]) -> None:
    for answer in answers:
        if isinstance(answer.dynamics, Unusable):
            raise RecordingError(answer.dynamics.reason)


def fit_text(answers: tuple[Answer, ...]) -> str:
    """All that is said of these answers: a table and a comparison first when there are several thrusters."""
    parts = [answer_text(answer) for answer in answers]
    if len(answers) > 1:
        same = alike(answers)
        parts = [set_text(answers), *([] if same is None else [alike_text(same)]), *parts]
    return "\n\n".join(parts)


@click.command("fit")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the fit here; - is standard output.")
@click.option(
    "--report", type=click.Path(dir_okay=False, path_type=Path), help="Write a page with figures here (HTML)."
)
@click.option(
    "--model", type=click.Choice(list(NAMES)), help="Model to report; by default C V|V| first, the others beside it."
)
@click.option(
    "--against",
    type=click.Choice(AGAINST),
    help="What explains the thrust; by default the first of these that was recorded.",
)
@click.option("--voltage", type=click.Choice(AGAINST), hidden=True, help="The former name of --against.")
@click.option("--method", type=click.Choice(["wls", "ls"]), default="wls", show_default=True, help="Weighting.")
@click.option(
    "--compare",
    type=click.Path(path_type=Path),
    multiple=True,
    help="JSON of an earlier fit: has a thruster changed since?",
)
def fit_command(
    files: tuple[Path, ...],
    json_path: Path | None,
    report: Path | None,
    model: str | None,
    against: str | None,
    voltage: str | None,
    method: Method,
    compare: tuple[Path, ...],
) -> None:
    """Fit thrust = C V|V| + tare and its rivals to one or more recordings, per thruster; compare the thrusters."""
    try:
        choice = NAMES[model or "C V|V|"]
        signal = choice.against or voltage or against or AGAINST[0]
        answers = fit_files(files, choice.model, signal, method, dynamics=True)
        if model == "dynamics":
            _rotor_told(answers)
        changes = [changed(answers, path) for path in compare]
        text = json.dumps(answer_json(answers, changes), indent=1, allow_nan=False)
        if json_path is not None and str(json_path) != "-":
            json_path.write_text(text + "\n", encoding="utf-8")
        if report is not None:
            from rig.report.fit import write_report  # matplotlib takes a second to come up: only where it is used

            write_report(answers, report, files, changes)
    except (RigError, OSError) as error:
        click.echo(f"rig fit: {error}", err=True)
        raise SystemExit(2) from error
    if json_path is not None and str(json_path) == "-":
        click.echo(text)
        return
    click.echo("\n\n".join([fit_text(answers), *(changed_text(one) for one in changes)]))
