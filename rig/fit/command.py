"""`rig fit FILE...`: thruster models per thruster, all thrusters compared, and compared with an earlier fit."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

from identification.estimation.least_squares import Method
from identification.thruster.thrust_data import Unusable
from identification.thruster.thrust_forms import Model
from rig.errors import RecordingError, RigError
from rig.fit.answer import Answer, expand, fit_files, fit_recordings
from rig.fit.as_json import answer_json, fit_json
from rig.fit.comparison import alike, changed
from rig.fit.one_pass import LONG, fit_one_pass, thrust_rows
from rig.fit.one_pass_text import one_pass_json, one_pass_text
from rig.fit.text import alike_text, answer_text, changed_text, set_text
from rig.fleet.options import Fleet, fleet_of, fleet_options, refuse_beside
from rig.recording.recover import rather_recovered
from rig.result_path import RESULT, RESULT_FILE

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


def _not_with_one_pass(*asked: tuple[str, object]) -> None:
    """Raises RecordingError for what a fit that has not kept its samples can't do."""
    given = [name for name, wanted in asked if wanted]
    if given:
        raise RecordingError(
            f"{', '.join(given)}: not in one pass, which keeps no samples (it is the way for more than {LONG:,} of "
            "them); leave it out, or ask for --in-memory"
        )


def _rows(files: Sequence[str], model: Model, signal: str, method: Method, fleet: Fleet) -> int:
    from rig.fit.row import COLUMNS, question_of
    from rig.fleet.asking import ask_all
    from rig.fleet.files import meant

    return ask_all(question_of(model, signal, method), COLUMNS, meant(files), fleet)


def _tell(text: str, json_path: Path | None, said: Iterable[str]) -> None:
    """JSON where it is wanted; what a person reads on standard output, unless the JSON goes there."""
    if json_path is not None and str(json_path) == "-":
        click.echo(text)
        return
    if json_path is not None:
        json_path.write_text(text + "\n", encoding="utf-8")
    click.echo("\n\n".join(said))


@click.command("fit")
@click.argument("files", nargs=-1, required=True, type=click.Path())
@click.option("--json", "json_path", type=RESULT, help="Write the fit here; - is standard output.")
@click.option("--report", type=RESULT_FILE, help="Write a page with figures here (HTML).")
@click.option(
    "--model",
    type=click.Choice(list(NAMES)),
    metavar="MODEL",
    help="Report this one (default: C V|V|, the others beside it): " + ", ".join(NAMES) + ".",
)
@click.option(
    "--against",
    type=click.Choice(AGAINST),
    help="What explains the thrust; by default the first of these that was recorded.",
)
@click.option("--voltage", type=click.Choice(AGAINST), hidden=True, help="The former name of --against.")
@click.option(
    "--method",
    type=click.Choice(["wls", "ls"]),
    default="wls",
    show_default=True,
    help="Weights: wls by the standard error of each hold, ls all alike.",
)
@click.option(
    "--compare",
    type=click.Path(path_type=Path),
    multiple=True,
    help="JSON of an earlier fit: has a thruster changed since?",
)
@click.option(
    "--one-pass/--in-memory",
    default=None,
    help="Fit all samples in one pass, in constant memory; by default above 200,000 of them.",
)
@fleet_options
def fit_command(
    files: tuple[str, ...],
    json_path: Path | None,
    report: Path | None,
    model: str | None,
    against: str | None,
    voltage: str | None,
    method: Method,
    compare: tuple[Path, ...],
    one_pass: bool | None,
    **asked: Any,
) -> None:
    """Fit thrust = C V|V| + tare and its rivals to one or more recordings, per thruster; compare the thrusters.

    With --jobs every file is fitted by itself, and has a row of a table; a file may then be a URL.
    """
    try:
        choice = NAMES[model or "C V|V|"]
        signal = choice.against or voltage or against or AGAINST[0]
        fleet = fleet_of(**asked)
        if fleet is not None:
            refuse_beside(("--json", json_path), ("--report", report), ("--compare", compare))
            refuse_beside(("--model dynamics", model == "dynamics"), ("--one-pass, --in-memory", one_pass is not None))
            raise SystemExit(_rows(files, choice.model, signal, method, fleet))
        given = rather_recovered(expand(map(Path, files)))
        if one_pass or (one_pass is None and thrust_rows(given) > LONG):
            refused = ("--model dynamics", model == "dynamics"), ("--report", report), ("--compare", compare)
            _not_with_one_pass(*refused, ("--method ls", method == "ls"))
            long = fit_one_pass(given, choice.model, signal)
            _tell(json.dumps(one_pass_json(long), indent=1, allow_nan=False), json_path, map(one_pass_text, long))
            return
        answers = fit_files(given, choice.model, signal, method, dynamics=True)
        if model == "dynamics":
            _rotor_told(answers)
        changes = [changed(answers, path) for path in compare]
        if report is not None:
            from rig.fit.report.page import write_report  # matplotlib takes a second to come up: only where it is used

            write_report(answers, report, given, changes)
        text = json.dumps(answer_json(answers, changes), indent=1, allow_nan=False)
        _tell(text, json_path, [fit_text(answers), *(changed_text(one) for one in changes)])
    except (RigError, OSError) as error:
        click.echo(f"rig fit: {error}", err=True)
        raise SystemExit(2) from error
