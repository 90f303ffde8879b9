"""How much better, on motion that was not fitted: whole runs, or blocks of time of the only one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.diagnosis import HeldOutRmse
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.validate.cross_validation import folds
from identification.mismatch.validate.held_out import Squares, compared, fitted_blocks
from identification.mismatch.vehicle.fitting import Fit, fit, weights
from identification.mismatch.vehicle.free_force import carried, free_force_of
from identification.mismatch.vehicle.model import Layout, on_other_runs, without_term
from identification.mismatch.vehicle.runs import Prepared, Run
from identification.mismatch.vehicle.search import State
from identification.recording import Floats

PIECES = 8
"""Of each run, by which the growth of an error is judged: motion that drifts off errs alike for long."""


def rms(parts: Sequence[Floats]) -> float:
    """The root mean square of all samples of all runs, in their unit."""
    whole = np.concatenate(parts)
    return float(np.sqrt(np.mean(whole**2)))


def noise_rms(noise: Noise) -> float:
    """Standard deviation of one sample, slow noise and all."""
    return float(np.sqrt(noise.white + sum(noise.slow) + sum(noise.band)))


def residuals(fitted: Fit, data: Prepared) -> list[Floats]:
    """(n,) of each run: measured motion less predicted, in its unit."""
    return [run.response - y for run, y in zip(data.runs, fitted.predicted, strict=True)]


def only(data: Prepared, runs: Sequence[Run]) -> Prepared:
    """The same preparation with these runs alone."""
    return replace(data, runs=tuple(runs))


def held_out(before: State, after: State, data: Prepared, unseen: Prepared | None) -> HeldOutRmse:
    """Both models on what was not fitted; `unseen`: runs that were given for it."""
    noise = noise_rms(after.noise)
    if unseen is not None:
        old, new = _elsewhere(before.fit, data, unseen, noise), _elsewhere(after.fit, data, unseen, noise)
        names = ", ".join(run.recording_id for run in unseen.runs)
        return _compared(old, new, noise, f"whole runs not fitted ({names}); only {_starts(after, data)} fitted")
    if len(data.runs) < policy.vehicle.VEHICLE_RUNS:
        return _by_blocks(before, after, data)
    left_out = folds(len(data.runs))
    olds: list[Floats] = []
    news: list[Floats] = []
    for fold in left_out:
        kept = only(data, [run for j, run in enumerate(data.runs) if j not in fold])
        back = only(data, [data.runs[j] for j in fold])
        olds += _elsewhere(_refitted(before, data, kept), kept, back, noise)
        news += _elsewhere(_refitted(after, data, kept), kept, back, noise)
    share = "each run" if len(left_out) == len(data.runs) else f"the runs, {len(left_out)} groups"
    what = (
        f"{share} in turn simulated by a model fitted to the others; only {_starts(after, data)} fitted; terms: on all"
    )
    return _compared(olds, news, noise, what)


def better_predicting(
    before: State, known: tuple[HeldOutRmse, State], other: State, data: Prepared, unseen: Prepared | None
) -> tuple[HeldOutRmse, State]:
    """A model with its error on what was not fitted, or another where that has a smaller one.

    What has no name, a free force or a term that is doubted, stays only where it predicts.
    """
    held = held_out(before, other, data, unseen)
    return (held, other) if held.after < known[0].after else known


def _starts(after: State, data: Prepared) -> str:
    """What is found on a held-out run itself."""
    own = " and a buoyancy of its own" if any(term.form == "by_ballast" for term in after.terms) else ""
    if data.runs[0].quantity == "speed" and not own:
        return "its speed at the start is"
    return f"its speed{' and place' if data.runs[0].quantity == 'position' else ''} at the start{own} are"


def _refitted(state: State, data: Prepared, kept: Prepared) -> Fit:
    """The same model from fewer runs, under the same noise."""
    layout = replace(state.fit.layout, runs=len(kept.runs))
    at = [data.runs.index(run) for run in kept.runs]
    begin = state.fit.layout.starts
    starts = np.concatenate([state.fit.theta[begin + 2 * j :][:2] for j in at])
    theta = np.append(state.fit.theta[:begin], starts)
    return fit(layout, theta, kept, weights(state.noise, kept), [state.fit.motions[j] for j in at])


def _elsewhere(fitted: Fit, data: Prepared, unseen: Prepared, noise: float) -> list[Floats]:
    """Residual in runs that were not fitted, of `noise` at each sample; a free force is laid over their own motion."""
    free = free_force_of(fitted.layout)
    if free is None:
        return residuals(_begun(fitted.layout, fitted.theta, data, unseen, noise), unseen)
    layout, theta = without_term(fitted.layout, data, fitted.theta, free)
    bare = _begun(layout, theta, data, unseen, noise)
    return residuals(_begun(carried(fitted.layout, free, bare, unseen), fitted.theta, data, unseen, noise), unseen)


def _begun(layout: Layout, theta: Floats, data: Prepared, unseen: Prepared, noise: float) -> Fit:
    """Other runs under this model: what begins a run, and a ballast of its own, are found on it, nothing else.

    Every row counts alike there, whatever the noise's colour.
    """
    old = replace(layout, runs=len(data.runs))
    new, start = on_other_runs(old, unseen, theta)
    fixed = np.ones(new.size)
    fixed[new.starts :] = 0.0
    known = {run.moment.ballast for run in data.runs}
    for term in new.parts:
        if term.form == "by_ballast":
            fixed[new.of(term)] = [one in known for one in unseen.scale.ballasts]
    return fit(new, start, unseen, weights(Noise(noise**2, 0.0), unseen), fixed=fixed)


def _by_blocks(before: State, after: State, data: Prepared) -> HeldOutRmse:
    """Simulated throughout; every fourth block of time is judged and not fitted."""
    keep = [fitted_blocks(run.time) for run in data.runs]
    white = weights(after.noise, data, keep)
    out = []
    for state in (before, after):
        found = fit(state.fit.layout, state.fit.theta, data, white, state.fit.motions, keep)
        out.append([r[~k] for r, k in zip(residuals(found, data), keep, strict=True)])
    rows = sum(int(np.sum(~k)) for k in keep)
    what = f"every fourth block of time, {rows} rows, simulated through from the commands; terms were chosen on all"
    return _compared(out[0], out[1], noise_rms(after.noise), what)


def _compared(old: Sequence[Floats], new: Sequence[Floats], noise: float, what: str) -> HeldOutRmse:
    return compared(_squares(old), _squares(new), noise, what)


def _squares(parts: Sequence[Floats]) -> Squares:
    """Of residuals of runs, each in pieces of time of equal length."""
    pieces = [piece for part in parts for piece in np.array_split(part, min(PIECES, part.size))]
    return Squares(np.array([float(p @ p) for p in pieces]), np.array([float(p.size) for p in pieces]))
