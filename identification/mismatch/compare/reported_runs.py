"""The runs of a diagnosis as a report looks at them: residuals, what each effect changes, and covariates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identification.mismatch.compare.saved_model_baseline import given
from identification.mismatch.diagnosis import Curves, Diagnosis
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.predictor import predict
from identification.mismatch.prepare.preparing import history_of
from identification.mismatch.prepare.scales import of_one_rate, scale_of
from identification.recording import Floats, Recording
from identification.run_history.history import TURNING, History
from identification.run_history.remembered import RememberedRun
from identification.twin import Twin


@dataclass(frozen=True, eq=False)
class Run:
    """One run at its rows with thrust, (n,) each."""

    recording_id: str
    time: Floats
    driver: Floats
    before: Floats
    """N, measured less baseline."""
    left: Floats
    """N, measured less model."""
    force: Floats
    """N, C driver |driver|."""
    step: Floats
    """N, change of `force` since the level before."""
    covariates: Mapping[str, Floats]
    """driver, time, time_since_step, time_since_reversal, previous_voltage, direction, and what else was recorded."""
    effects: Mapping[tuple[str, str], Floats] = field(default_factory=dict)
    """(effect, form) -> N that it changes the model by, beyond what C and the tares could take up; empty where the
    recordings were not at hand."""


def runs_of(diagnosis: Diagnosis, recordings: Sequence[Recording] = ()) -> tuple[Run, ...]:
    """What can be averaged. `recordings`: those diagnosed, in any order; without them there is less to see."""
    known = {r.recording_id: r for r in recordings}
    C = diagnosis.baseline["C"].value
    return _beyond_constants(
        [_run(curves, known.get(curves.recording_id), diagnosis.twin, C) for curves in diagnosis.curves]
    )


def _beyond_constants(runs: Sequence[Run]) -> tuple[Run, ...]:
    """The effects less what another C and other tares would do as well: what a refit without them leaves."""
    keys = set.intersection(*(set(run.effects) for run in runs)) if runs else set()
    if not keys:
        return tuple(runs)
    which = np.concatenate([np.full(run.time.size, i) for i, run in enumerate(runs)])
    columns = np.column_stack([np.concatenate([run.force for run in runs]), *(which == i for i in range(len(runs)))])
    ends = np.cumsum([run.time.size for run in runs])[:-1]
    left: list[dict[tuple[str, str], Floats]] = [{} for _ in runs]
    for key in sorted(keys):
        effect = np.concatenate([run.effects[key] for run in runs])
        beyond = effect - columns @ np.linalg.lstsq(columns, effect, rcond=None)[0]
        for out, part in zip(left, np.split(beyond, ends), strict=True):
            out[key] = part
    return tuple(replace(run, effects=effects) for run, effects in zip(runs, left, strict=True))


def _run(curves: Curves, recording: Recording | None, twin: Twin | None, C: float) -> Run:
    full = None if recording is None else history_of(recording)
    if isinstance(full, History) and twin is not None:
        (full,) = of_one_rate((full,), twin.slip_rate)
    if isinstance(full, History) and np.isin(curves.time, full.sampled).all():
        history, rows = full, np.searchsorted(full.sampled, curves.time)
        known = twin is not None and all(t.known for t in twin.terms)
        effects = _effects(twin, full, rows) if twin is not None and known else {}
    else:
        history, rows, effects = _history(curves), np.arange(curves.time.size), {}
    before = history.previous[rows]
    others = {name: value[rows] for name, value in history.others.items()}
    turning = np.where(np.abs(history.driver) > TURNING * history.size, np.sign(history.driver), 0.0)
    force = C * curves.driver * np.abs(curves.driver)
    return Run(
        curves.recording_id,
        curves.time,
        curves.driver,
        curves.thrust - curves.baseline,
        curves.thrust - curves.model,
        force,
        force - C * before * np.abs(before),
        {
            **others,
            "driver": curves.driver,
            "time": curves.time,
            "time_since_step": history.since_step[rows],
            "time_since_reversal": _since_reversal(history, turning)[rows],
            "previous_voltage": before,
            "direction": turning[rows],
            "direction_of_change": history.direction_of_change[rows],
        },
        effects,
    )


def _history(curves: Curves) -> History:
    """As much of a history as the curves tell."""
    t = curves.time
    between = 0.5 * (t[1:] + t[:-1])
    ends = (t[0] - (between[0] - t[0]), t[-1] + (t[-1] - between[-1])) if t.size > 1 else (t[0] - 0.5, t[0] + 0.5)
    edges = np.concatenate([[ends[0]], between, [ends[1]]])
    ones, none = np.ones(t.size, dtype=np.int64), np.zeros(t.size)
    return History(curves.recording_id, "command_voltage", edges, curves.driver, curves.thrust, ones, t, none)


def _since_reversal(history: History, turning: Floats) -> Floats:
    """(M,) s since the driver's sign was another one; NaN before the first reversal."""
    out = np.full(turning.size, np.nan)
    last, start = 0.0, np.nan
    for i, sign in enumerate(turning.tolist()):
        if sign and last and sign != last:
            start = float(history.edges[i])
        last = sign or last
        out[i] = history.middle[i] - start
    return out


def _effects(twin: Twin, history: History, rows: NDArray[np.intp]) -> dict[tuple[str, str], Floats]:
    """What each term of the twin changes, the others there."""
    theta = Theta(twin.C, (), (0.0,), k=twin.rate_per_driver or 1.0)
    run = RememberedRun(history)
    terms, scale = given(twin), scale_of([run], twin.C)
    full, _ = predict(Model((), terms), theta, run, scale)
    out: dict[tuple[str, str], Floats] = {}
    for i, term in enumerate(twin.terms):
        less, _ = predict(Model((), (*terms[:i], *terms[i + 1 :])), theta, run, scale)
        out[term.effect, term.form] = (full - less)[rows]
    return out
