"""The fit of one recording as a row of a table: `rig fit --jobs`. It knows no engine."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from identification.recording import Recording
from identification.thruster.settling import settling_time
from identification.thruster.thrust import Parameter
from identification.thruster.thrust_data import calibration_of, gain_std
from identification.thruster.thrust_report import verdicts
from rig.errors import RecordingError, UnreadError
from rig.fit.answer import Answer, fit_recordings
from rig.fit.as_json import number
from rig.fit.one_pass import LONG, OnePass, fit_one_pass, thrust_rows
from rig.fit.one_pass_text import remarks
from rig.fleet.columns import COMMON, Column
from rig.fleet.question import Question, Row
from rig.hdf5 import load
from rig.workers.version import version_of

SMALL: Final = 16 * LONG
"""Bytes of a file whose rows, a time and a thrust of 8 bytes each, need no counting: packed or not, it fits memory."""
PARAMETER: Final = (
    Column("name"),
    Column("value", "number"),
    Column("std", "number"),
    Column("std_statistical", "number"),
    Column("std_calibration", "number"),
    Column("dof", "number"),
    Column("low", "number"),
    Column("high", "number"),
    Column("unit"),
)
COLUMNS: Final = (
    *COMMON,
    Column("kind"),
    Column("opened_as"),
    Column("outcome"),
    Column("model"),
    Column("explained_by"),
    Column("way"),
    Column("C", "number"),
    Column("C_std", "number"),
    Column("C_std_statistical", "number"),
    Column("C_std_calibration", "number"),
    Column("C_dof", "number"),
    Column("C_unit"),
    Column("tare", "number", "N"),
    Column("tare_std", "number", "N"),
    Column("parameters", "structures", parts=PARAMETER),
    Column("n", "whole"),
    Column("rmse", "number", "N"),
    Column("rmse_of"),
    Column("chi2_per_dof", "number"),
    Column("chi2_p", "number"),
    Column("whiteness_p", "number"),
    Column("asymmetry", "number"),
    Column("asymmetry_std", "number"),
    Column("settling_time", "number", "s"),
    Column("settling_time_std", "number", "s"),
    Column("calibration"),
    Column("gain_std", "number"),
    Column("verdicts", "texts"),
)
"""`C` is the first coefficient of the model, `asymmetry` C+ over C- less one, `settling_time` by which thrust is late
after a step; numbers without a unit are ratios."""


@cache
def version() -> str:
    """Of the sources that have a say in a row."""
    import identification
    import rig.fit
    import rig.fleet
    import rig.hdf5

    return version_of(identification, rig.hdf5, rig.fit, rig.fleet)


def question_of(model: str, against: str, method: str) -> Question:
    """What `rig fit` with these options asks of each file."""
    options = {"model": model, "against": against, "method": method}
    return Question("fits", "rig.fit.row:answer", options, version())


def answer(path: Path, options: Mapping[str, Any]) -> Row:
    """The row of the recording in `path`, fitted alone; with an `error` where it can't be fitted.

    Raises RecordingError for what is no recording, UnreadError.
    """
    recording = load(path, rows=0) if _is_long(path) else load(path)
    try:
        found = _fitted(path, recording, options)
    except UnreadError:
        raise
    except RecordingError as error:
        found = {"error": str(error)}
    return _identity(recording) | found


def _is_long(path: Path) -> bool:
    return path.stat().st_size > SMALL and thrust_rows([path]) > LONG


def _identity(recording: Recording) -> Row:
    thrust = recording.first_of("thrust")
    return {
        "thruster": recording.thruster,
        "recording_id": recording.recording_id,
        "created": recording.created,
        "kind": recording.kind,
        "opened_as": str(recording.attributes.get("opened_as", "")),
        "outcome": recording.outcome,
        "calibration": "" if thrust is None else calibration_of(thrust),
        "gain_std": None if thrust is None else number(gain_std(thrust)),
    }


def _fitted(path: Path, recording: Recording, options: Mapping[str, Any]) -> Row:
    model, against, method = options["model"], options["against"], options["method"]
    if _is_long(path):
        if method == "ls":
            raise RecordingError(f"{path}: --method ls keeps all samples, and it has more than {LONG:,}; take wls")
        (long,) = fit_one_pass([path], model, against)
        return _of_one_pass(long)
    (found,) = fit_recordings([recording], model, against, method)
    return _of_answer(found) | _settling(recording)


def _of_answer(found: Answer) -> Row:
    fit = found.fit
    judged, white = fit.estimate.underfit, fit.whiteness
    return _parameters(fit.parameters, fit.tare) | {
        "model": fit.model,
        "explained_by": fit.voltage_quantity,
        "way": "in memory",
        "n": int(fit.estimate.rows.y.size),
        "rmse": number(fit.rmse),
        "rmse_of": fit.rmse_of,
        "chi2_per_dof": number(fit.chi2_per_dof),
        "chi2_p": None if judged is None else number(judged.p_value),
        "whiteness_p": None if white is None else number(white.p_value),
        "verdicts": [*verdicts(fit, found.alternatives), *found.notes],
        **_asymmetry(found),
    }


def _of_one_pass(found: OnePass) -> Row:
    return _parameters(found.parameters, found.tare) | {
        "model": found.form.name,
        "explained_by": found.passes[0].source.quantity,
        "way": "one pass",
        "n": found.rows,
        "rmse": number(found.rmse),
        "rmse_of": "samples",
        "verdicts": list(remarks(found)),
    }


def _asymmetry(found: Answer) -> Row:
    for fit in (found.fit, *found.alternatives):
        if fit.form.split and not fit.form.with_flow and fit.voltage_quantity == found.fit.voltage_quantity:
            plus, minus = list(fit.parameters.values())[:2]
            ratio = plus.value / minus.value
            spread = (plus.std_statistical / plus.value) ** 2 + (minus.std_statistical / minus.value) ** 2
            return {"asymmetry": number(ratio - 1.0), "asymmetry_std": number(abs(ratio) * spread**0.5)}
    return {}


def _settling(recording: Recording) -> Row:
    found = settling_time(recording)
    return {} if found is None else {"settling_time": number(found.value), "settling_time_std": number(found.std)}


def _parameters(found: Mapping[str, Parameter], tares: Mapping[str, Parameter]) -> Row:
    first, (tare,) = next(iter(found.values())), tares.values()
    return {
        "C": number(first.value),
        "C_std": number(first.std),
        "C_std_statistical": number(first.std_statistical),
        "C_std_calibration": number(first.std_calibration),
        "C_dof": number(first.dof),
        "C_unit": first.unit,
        "tare": number(tare.value),
        "tare_std": number(tare.std),
        "parameters": [_parameter(name, p) for name, p in found.items()],
    }


def _parameter(name: str, p: Parameter) -> Row:
    numbers = ("value", "std", "std_statistical", "std_calibration", "dof", "low", "high")
    return {"name": name, "unit": p.unit} | {key: number(getattr(p, key)) for key in numbers}
