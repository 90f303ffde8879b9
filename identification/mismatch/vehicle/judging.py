"""How much better, on motion that was not fitted: whole runs, or blocks of time of the only one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch.diagnosis import HeldOutRmse
from identification.mismatch.noise import Noise
from identification.mismatch.vehicle.fitting import Fit, Weights, fit, weights
from identification.mismatch.vehicle.left import Coordinate, Structure, coordinates, free_columns
from identification.mismatch.vehicle.model import on_other_runs, respond
from identification.mismatch.vehicle.runs import Prepared, Run
from identification.mismatch.vehicle.search import State
from identification.recording import Floats

FOLDS = 4
LEAST_RUNS = 3
"""With fewer, blocks of time are kept back."""
KEPT_BACK = 4
"""One block of so many is not fitted."""
BLOCKS = 24
PLAIN = Noise(1.0, 0.0)


def rms(parts: Sequence[Floats]) -> float:
    whole = np.concatenate(parts)
    return float(np.sqrt(np.mean(whole**2)))


def noise_rms(noise: Noise) -> float:
    """Standard deviation of one sample, slow noise and all."""
    return float(np.sqrt(noise.white + sum(noise.slow) + sum(noise.band)))


def residuals(fitted: Fit, data: Prepared) -> list[Floats]:
    return [run.response - y for run, y in zip(data.runs, fitted.predicted, strict=True)]


def only(data: Prepared, runs: Sequence[Run]) -> Prepared:
    return replace(data, runs=tuple(runs))


def held_out(
    before: State, after: State, data: Prepared, unseen: Prepared | None, flexible: Structure | None
) -> HeldOutRmse:
    """Both models on what was not fitted; `unseen`: runs that were given for it.

    `flexible`: a free force that the model after has too, fitted on the same part as its parameters.
    """
    noise = noise_rms(after.noise)
    if unseen is not None:
        old = _elsewhere(before.fit, data, unseen, None, after)
        new = _elsewhere(after.fit, data, unseen, flexible, after)
        names = ", ".join(run.recording_id for run in unseen.runs)
        return HeldOutRmse(rms(old), rms(new), noise, f"whole runs not fitted ({names}); only {_starts(data)} fitted")
    if len(data.runs) < LEAST_RUNS:
        return _by_blocks(before, after, data, flexible)
    folds = min(FOLDS, len(data.runs))
    olds: list[Floats] = []
    news: list[Floats] = []
    for fold in range(folds):
        kept = only(data, [run for j, run in enumerate(data.runs) if j % folds != fold])
        back = only(data, [run for j, run in enumerate(data.runs) if j % folds == fold])
        olds += _elsewhere(_refitted(before, data, kept), kept, back, None, after)
        news += _elsewhere(_refitted(after, data, kept), kept, back, flexible, after)
    share = "each run" if folds == len(data.runs) else f"the runs, {folds} groups"
    what = f"{share} in turn simulated by a model fitted to the others; only {_starts(data)} fitted; terms: on all"
    return HeldOutRmse(rms(olds), rms(news), noise, what)


def _starts(data: Prepared) -> str:
    return "its speed at the start is" if data.runs[0].quantity == "speed" else "its speed and place at the start are"


def _refitted(state: State, data: Prepared, kept: Prepared) -> Fit:
    """The same model from fewer runs, under the same noise."""
    layout = replace(state.fit.layout, runs=len(kept.runs))
    at = [data.runs.index(run) for run in kept.runs]
    begin = state.fit.layout.starts
    starts = np.concatenate([state.fit.theta[begin + 2 * j :][:2] for j in at])
    theta = np.append(state.fit.theta[:begin], starts)
    return fit(layout, theta, kept, weights(state.noise, kept), [state.fit.motions[j] for j in at])


def _elsewhere(fitted: Fit, data: Prepared, unseen: Prepared, flexible: Structure | None, after: State) -> list[Floats]:
    """Residual in runs that were not fitted: what begins a run, and a ballast of its own, are found on it."""
    layout, theta = on_other_runs(fitted.layout, unseen, fitted.theta)
    fixed = np.ones(layout.size)
    fixed[layout.starts :] = 0.0
    known = {run.moment.ballast for run in data.runs}
    for i, term in enumerate(layout.model.terms):
        if term.form == "by_ballast":
            for k, one in enumerate(unseen.scale.ballasts):
                fixed[layout.first_of[i] + k] = float(one in known)
    there = fit(layout, theta, unseen, weights(PLAIN, unseen), fixed=fixed)
    left = residuals(there, unseen)
    if flexible is None or flexible.coordinate.quantity in ("time", "run"):
        return left
    beta = free_force(fitted, data, flexible, after)
    moved = _on_runs(there, unseen, flexible.coordinate)
    return [
        r - respond(layout, there.theta, unseen, j, there.motions[j], moved.bumps(j))[:, :-2] @ beta
        for j, r in enumerate(left)
    ]


def free_force(fitted: Fit, data: Prepared, flexible: Structure, after: State) -> Floats:
    """(b,) N at the knots, from these runs alone."""
    moved = _on_runs(fitted, data, flexible.coordinate)
    white = weights(after.noise, data)
    columns = np.vstack([w.whiten(c) for w, c in zip(white, free_columns(fitted, data, moved), strict=True)])
    return _beside(columns, fitted)


def _on_runs(fitted: Fit, data: Prepared, coordinate: Coordinate) -> Coordinate:
    """The same knots over other runs."""
    for one in coordinates(fitted, data):
        if one.quantity == coordinate.quantity:
            return replace(one, knots=coordinate.knots)
    return replace(coordinate, values=tuple(np.full(run.steps, np.nan) for run in data.runs))


def _by_blocks(before: State, after: State, data: Prepared, flexible: Structure | None) -> HeldOutRmse:
    """Simulated throughout; every fourth block of time is judged and not fitted."""
    keep = [_blocks(run) for run in data.runs]
    out = []
    for state in (before, after):
        white = weights(after.noise, data, keep)
        found = fit(state.fit.layout, state.fit.theta, data, white, state.fit.motions, keep)
        left = residuals(found, data)
        if flexible is not None and state is after:
            left = _less_flexible(found, left, data, flexible, keep, white)
        out.append(rms([r[k == 0] for r, k in zip(left, keep, strict=True)]))
    rows = sum(int(np.sum(k == 0)) for k in keep)
    what = f"every fourth block of time, {rows} rows, simulated through from the commands; terms were chosen on all"
    return HeldOutRmse(out[0], out[1], noise_rms(after.noise), what)


def _less_flexible(
    fitted: Fit,
    left: Sequence[Floats],
    data: Prepared,
    flexible: Structure,
    keep: Sequence[Floats],
    white: Weights,
) -> list[Floats]:
    """Residuals less a free force fitted to the kept rows."""
    columns = free_columns(fitted, data, _on_runs(fitted, data, flexible.coordinate))
    kept = np.vstack([w.whiten(c[k > 0]) for w, c, k in zip(white, columns, keep, strict=True)])
    beta = _beside(kept, fitted)
    return [r - c @ beta for r, c in zip(left, columns, strict=True)]


def _beside(columns: Floats, fitted: Fit) -> Floats:
    """Forces (b,) at the knots from whitened columns, the model's own parameters free beside them."""
    rows = columns.shape[0]
    H = np.hstack([columns, fitted.jacobian[:rows]])
    size = np.sqrt(np.sum(H**2, axis=0))
    size[size == 0] = 1.0
    found, *_ = np.linalg.lstsq(H / size, fitted.residual[:rows], rcond=1e-4)
    return np.asarray(found[: columns.shape[1]] / size[: columns.shape[1]])


def _blocks(run: Run) -> Floats:
    """(n,) 1 where a row is fitted."""
    t = run.time - run.time[0]
    index = np.floor(t / (t[-1] / BLOCKS)).astype(int)
    out: Floats = (index % KEPT_BACK != KEPT_BACK - 2).astype(np.float64)
    return out
