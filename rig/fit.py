"""`rig fit FILE...`: fits per thruster, as text for a person and as JSON for a program."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import click
import numpy as np

from identification.estimation import Method
from identification.recording import Recording
from identification.thrust import Parameter, ThrustFit, fit_runs
from identification.thrust_data import Run, Unusable, prepare
from identification.thrust_forms import Model
from identification.thrust_report import digits, sentence, table, verdicts
from rig.errors import RecordingError, RigError
from rig.hdf5 import load

MODELS: tuple[Model, ...] = ("C V|V|", "C+/C-")
NAMES: dict[str, Model] = {"C": "C V|V|", "C V|V|": "C V|V|", "C_t n|n|": "C V|V|", "C+/C-": "C+/C-"}
"""What `--model` takes: one coefficient or one for each direction; V or n follows from `--against`."""
AGAINST = ("command_voltage", "motor_voltage", "rotation_rate")
"""What `--against` takes."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The fit asked for and the other model beside it, where the data allow it."""

    fit: ThrustFit
    alternatives: tuple[ThrustFit, ...]
    notes: tuple[str, ...] = ()


def fit_recordings(
    recordings: Sequence[Recording], model: Model = "C V|V|", voltage: str = "command_voltage", method: Method = "wls"
) -> tuple[Answer, ...]:
    """One answer per thruster, in order of first appearance. Raises RecordingError for input that cannot be used."""
    seen: dict[str, str] = {}
    groups: dict[str, list[Run]] = {}
    notes: dict[str, list[str]] = {}
    for recording in recordings:
        name = recording.source or recording.recording_id
        if recording.recording_id in seen:
            other = seen[recording.recording_id]
            raise RecordingError(f"{name} is the same recording as {other} ({recording.recording_id}); give it once")
        seen[recording.recording_id] = name
        run = prepare(recording, voltage)
        if isinstance(run, Unusable):
            raise RecordingError(run.reason)
        groups.setdefault(recording.thruster, []).append(run)
        if recording.outcome in {"aborted", "tripped"}:
            notes.setdefault(recording.thruster, []).append(f"{name} was {recording.outcome}: what it holds was used")
    return tuple(_answer(runs, model, method, tuple(notes.get(thruster, ()))) for thruster, runs in groups.items())


def _answer(runs: Sequence[Run], model: Model, method: Method, notes: tuple[str, ...]) -> Answer:
    fit = fit_runs(runs, model, method)
    if isinstance(fit, Unusable):
        raise RecordingError(fit.reason)
    others = [fit_runs(runs, other, method) for other in MODELS if other != model]
    return Answer(fit, tuple(other for other in others if isinstance(other, ThrustFit)), notes)


def fit_files(
    paths: Iterable[Path], model: Model = "C V|V|", voltage: str = "command_voltage", method: Method = "wls"
) -> tuple[Answer, ...]:
    """Load and fit; a folder stands for every `*.h5` in it. Raises RecordingError with one sentence."""
    files = list(chain.from_iterable(_expand(Path(path)) for path in paths))
    if not files:
        raise RecordingError("rig fit: no recording was given; expected one or more *.h5 files")
    return fit_recordings([load(path) for path in files], model, voltage, method)


def _expand(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(path.glob("*.h5"))
    if not found:
        raise RecordingError(f"{path} is a folder without recordings; expected *.h5 files in it")
    return found


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and np.isfinite(value) else None


def _parameter_json(p: Parameter) -> dict[str, Any]:
    return {
        "value": _number(p.value),
        "std": _number(p.std),
        "unit": p.unit,
        "std_statistical": _number(p.std_statistical),
        "std_calibration": _number(p.std_calibration),
        "std_internal": _number(p.std_internal),
        "dof": _number(p.dof),
        "interval_95": [_number(p.low), _number(p.high)],
    }


def _points_json(fit: ThrustFit) -> list[dict[str, Any]]:
    out = []
    for run in fit.runs:
        for point in run.points.points if run.points is not None and fit.rmse_of == "points" else ():
            e = point.thrust
            numbers = {
                "voltage": point.voltage,
                "thrust": e.mean,
                "std_error": e.std_error,
                "n_effective": e.n_effective,
            }
            window = {"t_start": e.t_start, "t_end": e.t_end, "drift": e.drift, "drift_std": e.drift_std}
            known = {key: _number(value) for key, value in (numbers | window).items()}
            out.append({"recording": run.recording_id, "n": e.n, "steady": point.steady, "phase": point.phase, **known})
    return out


def fit_json(fit: ThrustFit) -> dict[str, Any]:
    """The stable keys first, then what more is known. Numbers are finite or null."""
    judged, solved = fit.estimate.underfit, fit.estimate.fit
    return {
        "thruster": fit.thruster,
        "recordings": list(fit.recordings),
        "model": fit.model,
        "parameters": {name: _parameter_json(p) for name, p in fit.parameters.items()},
        "tare": {name: _parameter_json(p) for name, p in fit.tare.items()},
        "rmse": _number(fit.rmse),
        "chi2_per_dof": _number(fit.chi2_per_dof),
        "rmse_of": fit.rmse_of,
        "n": int(fit.estimate.rows.y.size),
        "dof": solved.dof,
        "chi2_p": _number(None if judged is None else judged.p_value),
        "underfit": None if judged is None else judged.underfitted,
        "birge_ratio": _number(fit.estimate.birge_ratio),
        "excess_std": _number(fit.estimate.excess_std),
        "sigma": _number(fit.sigma),
        "whiteness_p": _number(None if fit.whiteness is None else fit.whiteness.p_value),
        "difference_p": _number(None if fit.difference is None else fit.difference.p_value),
        "singular_values": [_number(s) for s in solved.singular_values],
        "condition": _number(solved.condition),
        "voltage": fit.voltage_quantity,
        "unsteady_points": fit.unsteady,
        "skipped_samples": fit.skipped,
    }


def answer_json(answers: Sequence[Answer]) -> dict[str, Any]:
    """`thruster-rig-fit` version 1: one entry per thruster with the model asked for, others under `alternatives`."""
    fits = []
    for answer in answers:
        entry = fit_json(answer.fit)
        entry["points"] = _points_json(answer.fit)
        entry["verdicts"] = [*verdicts(answer.fit, answer.alternatives), *answer.notes]
        entry["alternatives"] = [fit_json(other) for other in answer.alternatives]
        fits.append(entry)
    return {"format": "thruster-rig-fit", "version": 1, "fits": fits}


def answer_text(answer: Answer) -> str:
    """Sentence, table, verdicts; plain text in 100 columns."""
    lines = [sentence(answer.fit), ""]
    form = "  {:<9}{:>14}{:>12}{:>14}{:>14}  {:<7}{:>9}  {}"
    lines.append(form.format("", "value", "std", "95 % from", "to", "unit", "error", "").rstrip())
    for fit in (answer.fit, *answer.alternatives):
        lines.append(f" {fit.model}: RMSE {fit.rmse:.4g} N")
        for row in table(fit):
            numbers = [digits(x, row.std) for x in (row.value, row.std, row.low, row.high)]
            known = [text if text != "not determined" else "-" for text in numbers]
            error = f"{row.percent:.2g} %" if np.isfinite(row.percent) else "-"
            lines.append(form.format(row.name, *known, row.unit, error, row.verdict).rstrip())
    lines.append("")
    lines += [f"  - {text}" for text in (*verdicts(answer.fit, answer.alternatives), *answer.notes)]
    return "\n".join(lines)


@click.command("fit")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--json", "json_path", type=click.Path(path_type=Path), help="Write the fit here; - is standard output.")
@click.option(
    "--report", type=click.Path(dir_okay=False, path_type=Path), help="Write a page with figures here (HTML)."
)
@click.option("--model", type=click.Choice(list(NAMES)), default="C V|V|", show_default=True, help="Model to report.")
@click.option(
    "--against",
    type=click.Choice(AGAINST),
    default="command_voltage",
    show_default=True,
    help="What explains the thrust; the next one where it was not recorded.",
)
@click.option("--voltage", type=click.Choice(AGAINST), hidden=True, help="The former name of --against.")
@click.option("--method", type=click.Choice(["wls", "ls"]), default="wls", show_default=True, help="Weighting.")
def fit_command(
    files: tuple[Path, ...],
    json_path: Path | None,
    report: Path | None,
    model: str,
    against: str,
    voltage: str | None,
    method: Method,
) -> None:
    """Fit thrust = C V|V| + tare to one or more recordings, per thruster; C_t n|n| where only n was recorded."""
    try:
        answers = fit_files(files, NAMES[model], voltage or against, method)
        text = json.dumps(answer_json(answers), indent=1, allow_nan=False)
        if json_path is not None and str(json_path) != "-":
            json_path.write_text(text + "\n", encoding="utf-8")
        if report is not None:
            from rig.report.fit import write_report  # matplotlib takes a second to come up: only where it is used

            write_report(answers, report, files)
    except (RigError, OSError) as error:
        click.echo(f"rig fit: {error}", err=True)
        raise SystemExit(2) from error
    if json_path is not None and str(json_path) == "-":
        click.echo(text)
    else:
        click.echo("\n\n".join(answer_text(answer) for answer in answers))
