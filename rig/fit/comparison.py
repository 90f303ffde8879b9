"""The thrusters of one `rig fit` beside one another, and beside an earlier fit: statistics are `identification`'s."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identification.thruster.comparison import (
    MANY,
    Change,
    Difference,
    Group,
    Homogeneity,
    changes,
    comparable,
    homogeneity,
    odd_ones,
    pairs,
    share_calibration,
)
from identification.thruster.repeatability import Repeatability, repeatability, with_repeatability
from identification.thruster.thrust import Parameter, ThrustFit, fit_runs
from identification.thruster.thrust_forms import model_of
from rig.errors import RecordingError
from rig.fit.answer import FIT_FORMAT, FIT_VERSION, Answer


@dataclass(frozen=True, eq=False)
class Alike:
    """Are the thrusters of this fit the same?"""

    groups: tuple[Group, ...]
    """As compared: with the cell's gain where it is not common, with what changes from recording to recording."""
    shared: bool
    """One cell, one calibration: its gain error cancels."""
    test: Homogeneity
    odd: tuple[str, ...]
    """Those that differ from the rest, most different first."""
    rest: Homogeneity | None
    """Test of the rest; None: there is no rest that is alike."""
    pairs: tuple[Difference, ...]
    repeat: Repeatability | None


@dataclass(frozen=True, eq=False)
class Changed:
    """The present fit against an earlier one."""

    source: str
    changes: tuple[Change, ...]
    shared: tuple[bool, ...]
    """Of each change: both campaigns state the same calibration."""
    notes: tuple[str, ...]


def group_of(fit: ThrustFit) -> Group | None:
    """Coefficients of a fit as a group; None when one of them, or its scatter, is not determined."""
    p = len(fit.parameters)
    cov = fit.cov_statistical[:p, :p]
    dof = min(q.dof_statistical for q in fit.parameters.values())
    known = {run.calibration for run in fit.runs}
    return _group(
        fit.thruster,
        tuple(fit.parameters),
        fit.values[:p],
        cov,
        dof,
        max(run.gain_std for run in fit.runs),
        known.pop() if len(known) == 1 else "",
        len(fit.recordings),
    )


def _group(
    name: str, names: tuple[str, ...], mean: Any, cov: Any, dof: float, gain: float, calibration: str, count: int
) -> Group | None:
    usable = np.all(np.isfinite(mean)) and np.all(np.isfinite(cov)) and dof > 0
    if not usable or float(np.linalg.eigvalsh(cov).min()) <= 0:
        return None
    return Group(name, names, mean, cov, min(dof, MANY), gain, calibration, count)


def _by_recording(fit: ThrustFit) -> list[Group]:
    """Each recording of a thruster fitted alone."""
    alone = [fit_runs([run], model_of(fit.form)) for run in fit.runs] if len(fit.runs) > 1 else []
    found = [group_of(one) for one in alone if isinstance(one, ThrustFit)]
    return [group for group in found if group is not None]


def repeats(answers: Sequence[Answer]) -> Repeatability | None:
    """What changes from one recording of a thruster to the next; None when each has one."""
    return repeatability([_by_recording(answer.fit) for answer in answers])


def alike(answers: Sequence[Answer]) -> Alike | None:
    """Compare all thrusters whose coefficients are determined; None when there are not two of one model."""
    found = [group_of(answer.fit) for answer in answers]
    groups = [group for group in found if group is not None]
    if len(groups) < 2 or len({answer.fit.form for answer in answers}) != 1:
        return None
    repeat = repeats(answers)
    compared = tuple(with_repeatability(group, repeat) for group in comparable(groups))
    odd, rest = odd_ones(compared)
    return Alike(compared, share_calibration(groups), homogeneity(compared), odd, rest, pairs(compared), repeat)


def read_fit(path: Path) -> dict[str, Any]:
    """A `thruster-rig-fit` document. Raises RecordingError with one sentence."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RecordingError(f"{path}: expected the JSON of an earlier `rig fit --json`, got none ({error})") from error
    if not isinstance(document, dict) or document.get("format") != FIT_FORMAT:
        raise RecordingError(f"{path}: expected a file of format {FIT_FORMAT}; make one with `rig fit ... --json FILE`")
    if document.get("version") != FIT_VERSION:
        version = document.get("version")
        raise RecordingError(f"{path}: version {version!r} of {FIT_FORMAT}, expected {FIT_VERSION}")
    return document


def group_of_json(entry: Mapping[str, Any], thruster: str) -> Group | None:
    """`group_of` from a fit's JSON; one written before the covariance was in it has its standard deviations only."""
    found = entry["parameters"]
    values = np.array([_float(p["value"]) for p in found.values()])
    stds = np.array([_float(p["std_statistical"]) for p in found.values()])
    cov = np.diag(stds**2)
    if "covariance" in entry:
        p = values.size
        cov = np.array([[_float(x) for x in row[:p]] for row in entry["covariance"]["statistical"][:p]])
    dofs = [
        (MANY if p["dof"] is None else float(p["dof"])) * (_float(p["std_statistical"]) / _float(p["std"])) ** 4
        for p in found.values()
        if p["std"]
    ]
    gains = [_float(p["std_calibration"]) / abs(_float(p["value"])) for p in found.values() if p["value"]]
    calibration = str(entry.get("calibration", ""))
    count = len(entry["recordings"])
    return _group(
        thruster, tuple(found), values, cov, min(dofs, default=0.0), max(gains, default=0.0), calibration, count
    )


def _float(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")


def _find(document: Mapping[str, Any], fit: ThrustFit) -> tuple[Mapping[str, Any] | None, str]:
    """The entry of the same thruster and model, or the sentence why there is none."""
    entries = [entry for entry in document["fits"] if entry["thruster"] == fit.thruster]
    if not entries:
        return None, f"{fit.thruster or 'this thruster'} is not in the earlier fit: nothing to compare it with"
    ours = set(fit.recordings) & {name for entry in entries for name in entry["recordings"]}
    if ours:
        name = sorted(ours)[0]
        return None, f"{fit.thruster}: recording {name} is in both fits; a recording cannot differ from itself"
    found = of_model(entries, fit.model)
    return found, "" if found else f"{fit.thruster}: the earlier fit has no {fit.model}, only {entries[0]['model']}"


def of_model(entries: Iterable[Mapping[str, Any]], model: str) -> Mapping[str, Any] | None:
    """Of a thruster's entries in a fit's JSON the one of that model, which may be an alternative of another."""
    for entry in entries:
        for one in (entry, *entry.get("alternatives", ())):
            if one["model"] == model:
                return {"calibration": entry.get("calibration", ""), **one}
    return None


def changed(answers: Sequence[Answer], path: Path) -> Changed:
    """Compare with the fit in `path`. Raises RecordingError when that is no fit."""
    document = read_fit(path)
    repeat = repeats(answers)
    both: list[tuple[Group, Group]] = []
    notes: list[str] = []
    try:
        for answer in answers:
            entry, why = _find(document, answer.fit)
            new = group_of(answer.fit)
            old = None if entry is None else group_of_json(entry, answer.fit.thruster)
            if old is not None and new is not None:
                both.append((with_repeatability(old, repeat), with_repeatability(new, repeat)))
            else:
                notes.append(why or f"{answer.fit.thruster}: coefficients are not determined in both fits")
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise RecordingError(f"{path}: a fit in it is not as {FIT_FORMAT} {FIT_VERSION} has it ({error!r})") from error
    shared = [share_calibration(pair) for pair in both for _ in pair[0].coefficients]
    return Changed(str(path), changes(both), tuple(shared), tuple(notes))


def named(fit: ThrustFit, name: str) -> str:
    """A coefficient's name among those of other thrusters, as `identification.vehicle.efficiency` has it: `C+[T1]`."""
    return f"{name.replace('_plus', '+').replace('_minus', '-')}[{fit.thruster}]"


def coefficients(answers: Sequence[Answer]) -> tuple[tuple[str, ...], list[Parameter], Any]:
    """Names, values and covariance (p, p) of all thrusters' coefficients: gain errors of one cell are common."""
    names = tuple(named(answer.fit, name) for answer in answers for name in answer.fit.parameters)
    found = [p for answer in answers for p in answer.fit.parameters.values()]
    sizes = [len(answer.fit.parameters) for answer in answers]
    cells = [answer.fit.runs[0].calibration for answer in answers for _ in answer.fit.parameters]
    gain = np.array([p.std_calibration * np.sign(p.value) for p in found])
    common = np.array([[a == b for b in cells] for a in cells])
    cov = np.where(common, np.outer(gain, gain), 0.0)
    at = 0
    for answer, size in zip(answers, sizes, strict=True):
        cov[at : at + size, at : at + size] += answer.fit.cov_statistical[:size, :size]
        at += size
    return names, found, cov
