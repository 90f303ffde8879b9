"""How much better, on data that was not fitted: blocks of time kept back, or whole runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.estimation.tails import student_sf
from identification.mismatch import policy
from identification.mismatch.diagnosis import HeldOutRmse
from identification.mismatch.estimate.clock_hollows import with_clocks_of
from identification.mismatch.estimate.estimate import Estimate, forces
from identification.mismatch.estimate.fitting import Fit, fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.each_sample import foretold
from identification.mismatch.model.model import Model
from identification.mismatch.model.parameters import Theta
from identification.mismatch.model.whitening import weights
from identification.mismatch.noise.covariance import Noise
from identification.physics.term import Scale, Term
from identification.recording import Floats
from identification.run_history.history import History
from identification.run_history.remembered import RememberedRun

KEPT_BACK = 4
"""One block of so many is not fitted: a quarter judges, and three quarters still determine the model."""
BLOCKS_PER_RUN = 24
"""Blocks of time of a long run: enough that every part of a plan is in both shares."""
TABLE_PIECES = 8
"""Pieces of a table of levels by which the growth of an error is judged."""
LEAST_BLOCK = 8.0
"""s: a shorter block would be known from its neighbours, whose slow noise it shares."""


def blocks(history: History) -> NDArray[np.bool_]:
    """(n,) of bool at the thrust rows: which are fitted. Every fourth block of time (or level) is kept back."""
    t = history.sampled[history.rows]
    if history.static:
        return np.asarray(np.arange(t.size) % KEPT_BACK != KEPT_BACK - 2)
    return fitted_blocks(t)


def fitted_blocks(t: Floats) -> NDArray[np.bool_]:
    """(n,) of bool at times in s: all but every fourth of the blocks of time."""
    return np.asarray(_block_of(t) % KEPT_BACK != KEPT_BACK - 2)


def _block_of(t: Floats) -> NDArray[np.intp]:
    span = float(t[-1] - t[0])
    length = max(span / BLOCKS_PER_RUN, min(LEAST_BLOCK, span / 8), np.finfo(float).tiny)
    return np.asarray(np.floor((t - t[0]) / length), dtype=np.intp)


@dataclass(frozen=True, eq=False, slots=True)
class Squares:
    """Squared errors of a model in pieces of time, (p,) each."""

    error: Floats
    """N^2, summed over samples."""
    samples: Floats

    @property
    def rmse(self) -> float:
        """Per sample, N."""
        samples = float(self.samples.sum())
        return float(np.sqrt(self.error.sum() / samples)) if samples else float("nan")


def together(parts: Sequence[Squares]) -> Squares:
    """Of all runs."""
    return Squares(np.concatenate([p.error for p in parts]), np.concatenate([p.samples for p in parts]))


def squares(model: Model, theta: Theta, data: Data, which: Sequence[NDArray[np.bool_]]) -> Squares:
    """Over the rows in `which`, by blocks of time (of a table an eighth of its levels): scatter within a row is in it,
    about what the model says of each sample."""
    thrust, _ = raw(model, theta, data, with_rate=False)
    found = []
    for run, rows, f, w, tare in zip(data.runs, data.rows, thrust, which, theta.tares, strict=True):
        h, r = run.history, rows[w]
        each = h.count[r] * (h.thrust[r] - f[w]) ** 2 + _scatter(model, theta, run, data.scale, tare)[r]
        piece = _pieces(h)[w]
        error, count = (np.asarray(np.bincount(piece, weights=x), dtype=np.float64) for x in (each, h.count[r]))
        found.append(Squares(error[count > 0], count[count > 0]))
    return together(found)


def _scatter(model: Model, theta: Theta, run: RememberedRun, scale: Scale, tare: float) -> Floats:
    """(M,) N^2, sum of squares within each interval about its mean, of what the model leaves: on a ramp an interval of
    several samples moves."""
    h = run.history
    samples = h.thrust_samples
    if h.sample_thrust.size != samples.time.size or h.static:
        return h.within
    left = h.sample_thrust - foretold(model, theta, run, scale, tare)
    left -= samples.means(left)[samples.interval]
    return np.asarray(np.bincount(samples.interval, weights=left**2, minlength=samples.count.size), dtype=np.float64)


def _pieces(history: History) -> NDArray[np.intp]:
    """(n,) at the thrust rows: which block of time each is in."""
    t = history.sampled[history.rows]
    return np.arange(t.size) * TABLE_PIECES // max(t.size, 1) if history.static else _block_of(t)


def rmse(model: Model, theta: Theta, data: Data, which: Sequence[NDArray[np.bool_]]) -> float:
    """Per sample, N, over the rows in `which`: scatter within a row is in it."""
    return squares(model, theta, data, which).rmse


def growth_p(before: Squares, after: Squares) -> float:
    """p-value that the error is no larger after than before: Student's t over the blocks, one-sided; 1 where they are
    too few to tell."""
    K = after.error.size
    if K < policy.validate.LEAST_BLOCKS or before.error.size != K:
        return 1.0
    growth = after.error - before.error
    error = float(np.std(growth, ddof=1)) / np.sqrt(K)
    if error == 0:
        return 0.0 if growth[0] > 0 else 1.0
    return float(student_sf(float(np.mean(growth)) / error, K - 1))


def least_noise(fitted: Fit, noises: Sequence[Noise], data: Data, which: Sequence[NDArray[np.bool_]]) -> float:
    """N per sample, rms: the lowest of these noises, and no louder than what the model leaves where it was fitted.

    What a model leaves out makes its noise seem louder, and slow noise is uncertain by more than its size.
    """
    n, p = fitted.residual.size, int(fitted.free.sum())
    left = rmse(fitted.model, fitted.theta, data, which) * np.sqrt(n / max(n - p, 1))
    every = [np.ones(r.size, dtype=bool) for r in data.rows]
    return min(float(left), *(noise_rms(each, fitted.model, fitted.theta, data, every) for each in noises))


def noise_rms(noise: Noise, model: Model, theta: Theta, data: Data, which: Sequence[NDArray[np.bool_]]) -> float:
    """What the estimated noise alone gives per sample, N."""
    size = forces(model, theta, data)
    total = samples = 0.0
    for h, rows, f, w in zip(data.histories, data.rows, size, which, strict=True):
        count = h.count[rows[w]].astype(np.float64)
        each = noise.white + noise.proportional * f[w] ** 2 + sum(noise.slow) + sum(noise.band)
        total += float(count @ each)
        samples += float(count.sum())
    return float(np.sqrt(total / samples)) if samples else float("nan")


def refitted(estimate: Estimate, data: Data, keep: Sequence[NDArray[np.bool_]]) -> Fit:
    """Parameters of the same model from a part of the rows, with the same noise."""
    part = replace(data, keep=tuple(keep))
    w = weights(part, estimate.noise, forces(estimate.fit.model, estimate.fit.theta, part), estimate.rate_noise)
    return with_clocks_of(estimate.fit.theta, fit(estimate.fit.model, estimate.fit.theta, part, w), part, w)


def by_blocks(before: Estimate, after: Estimate, data: Data, measured: Data, quiet: Noise) -> HeldOutRmse:
    """Parameters of both models without every fourth block, judged on those blocks.

    `measured`: the same runs with the periodic disturbances still in them, for the model before. `quiet`: noise of
    another model of these runs.
    """
    keep = [blocks(h) for h in data.histories]
    back = [~k for k in keep]
    old, new = refitted(before, measured, keep), refitted(after, data, keep)
    noise = least_noise(new, (after.noise, quiet), data, keep)
    held = "levels" if data.histories[0].static else "blocks of time"
    what = f"every fourth of the {held}, {sum(int(b.sum()) for b in back)} rows; terms were chosen on all of them"
    errors = squares(old.model, old.theta, measured, back), squares(new.model, new.theta, data, back)
    found = compared(*errors, noise, what)
    if found.after < found.before:
        return found
    chi2 = judge_blocks(replace(after, fit=new), data, keep)
    price = held_out_price(max(int(new.free.sum() - old.free.sum()), 0))
    return replace(found, whitened_fall=chi2(old).chi2 - chi2(new).chi2 - price)


def held_out_price(parameters: int) -> float:
    """Of chi-square on what was not fitted, for so many more parameters."""
    return float(policy.validate.HELD_OUT_WORTH) + 2 * parameters


def compared(before: Squares, after: Squares, noise: float, what: str) -> HeldOutRmse:
    """The error before and after, N per sample, and whether it grew beyond chance."""
    return HeldOutRmse(before.rmse, after.rmse, noise, what, growth_p(before, after))


def by_runs(
    before: Estimate,
    after: Estimate,
    data: Data,
    others: Sequence[History],
    quiet: Noise,
    leaving: Sequence[Term] = (),
) -> HeldOutRmse:
    """Both models on whole runs that were not fitted; of these only the tare is. `quiet` as in `by_blocks`.

    `leaving`: terms of `after` that are left out there.
    """
    unseen = Data(tuple(others), data.scale, with_rate=False, most_shift=data.most_shift)
    every = [np.ones(r.size, dtype=bool) for r in unseen.rows]
    errors = []
    for model, theta in ((before.fit.model, before.fit.theta), after.fit.less(*leaving)):
        errors.append(squares(model, with_tares(model, theta, unseen), unseen, every))
    noise = least_noise(after.fit, (after.noise, quiet), data, [np.ones(r.size, dtype=bool) for r in data.rows])
    names = ", ".join(h.recording_id for h in others)
    return compared(errors[0], errors[1], noise, f"whole runs not fitted ({names}); only their tare is fitted")


@dataclass(frozen=True, slots=True)
class Score:
    """Of a fit on what it was not fitted to."""

    rmse: float
    """Per sample, N."""
    chi2: float
    """Of the residual, whitened with one and the same noise."""


def judge_blocks(estimate: Estimate, data: Data, keep: Sequence[NDArray[np.bool_]]) -> Callable[[Fit], Score]:
    """Judges fits of the rows in `keep` on all others, with the noise of `estimate`."""
    back = [~k for k in keep]
    part = replace(data, keep=tuple(back))
    w = weights(part, estimate.noise, forces(estimate.fit.model, estimate.fit.theta, part), None)

    def score(found: Fit) -> Score:
        thrust, _ = raw(found.model, found.theta, part, with_rate=False)
        left = w.whiten([y - f for y, f in zip(part.thrust, thrust, strict=True)], [])
        return Score(rmse(found.model, found.theta, data, back), float(left @ left))

    return score


def judge_runs(estimate: Estimate, data: Data, others: Sequence[History]) -> Callable[[Fit], Score]:
    """Judges fits on whole runs, their tares fitted; a fit that needs what one of these lacks is infinitely bad."""
    unseen = Data(tuple(others), data.scale, with_rate=False, most_shift=data.most_shift)
    every = [np.ones(r.size, dtype=bool) for r in unseen.rows]
    first = with_tares(estimate.fit.model, estimate.fit.theta, unseen)
    w = weights(unseen, estimate.noise, forces(estimate.fit.model, first, unseen), None)

    def score(found: Fit) -> Score:
        if any(not set(term.needs) <= set(h.others) for term in found.model.terms for h in others):
            return Score(float("inf"), float("inf"))
        theta = with_tares(found.model, found.theta, unseen)
        thrust, _ = raw(found.model, theta, unseen, with_rate=False)
        left = w.whiten([y - f for y, f in zip(unseen.thrust, thrust, strict=True)], [])
        return Score(rmse(found.model, theta, unseen, every), float(left @ left))

    return score


def with_tares(model: Model, theta: Theta, data: Data) -> Theta:
    """The same with the tares that the runs of `data` want, one each."""
    zero = replace(theta, tares=tuple(0.0 for _ in data.histories))
    thrust, _ = raw(model, zero, data, with_rate=False)
    tares = [
        float(np.average(y - f, weights=h.count[r]))
        for y, f, h, r in zip(data.thrust, thrust, data.histories, data.rows, strict=True)
    ]
    return replace(theta, tares=tuple(tares))
