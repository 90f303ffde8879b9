"""Held-out judgement on whole runs where several were given: each is predicted by what the others tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.mismatch import policy
from identification.mismatch.diagnosis import HeldOutRmse
from identification.mismatch.estimate.clock_hollows import with_clocks_of
from identification.mismatch.estimate.estimate import Estimate, forces
from identification.mismatch.estimate.fitting import Fit, fit
from identification.mismatch.model.data import Data
from identification.mismatch.model.whitening import weights
from identification.mismatch.noise.covariance import Noise
from identification.mismatch.validate.held_out import (
    Squares,
    by_blocks,
    compared,
    least_noise,
    squares,
    together,
    with_tares,
)
from identification.physics.term import Term

FOLDS = 4
"""Runs are left out one by one, or in as many groups: each costs two fits."""


def folds(runs: int) -> list[list[int]]:
    """Which runs are left out together: each alone, or in FOLDS groups where there are more.

    >>> folds(2), folds(5)
    ([[0], [1]], [[0, 1], [2], [3], [4]])
    """
    return [fold.tolist() for fold in np.array_split(np.arange(runs), min(runs, FOLDS))]


def by_folds(
    before: Estimate, after: Estimate, data: Data, measured: Data, quiet: Noise, leaving: Sequence[Term] = ()
) -> HeldOutRmse:
    """Both models fitted without a run and judged on it, every run in turn; of the run itself only its tare is fitted.

    By blocks of time where there is one run, or one that is no match for the others. Arguments as of `by_blocks`;
    `leaving`: terms of `after` that are left out on another run than those fitted.
    """
    R = len(data.histories)
    if R < 2 or not _alike(data):
        return by_blocks(before, after, data, measured, quiet)
    left_out = folds(R)
    old = [_judged(before, measured, fold) for fold in left_out]
    new = [_judged(after, data, fold, leaving) for fold in left_out]
    keep = [np.ones(r.size, dtype=bool) for r in data.rows]
    noise = least_noise(after.fit, (after.noise, quiet), data, keep)
    each = "each run" if len(left_out) == R else f"each of {len(left_out)} groups of runs"
    what = f"{each} by a model fitted to the others, its own tare fitted; terms were chosen on all of them"
    return compared(together(old), together(new), noise, what)


def _alike(data: Data) -> bool:
    driver = np.array([float(np.max(np.abs(h.driver[r]))) for h, r in zip(data.histories, data.rows, strict=True)])
    samples = np.array([float(h.count[r].sum()) for h, r in zip(data.histories, data.rows, strict=True)])
    return bool(
        driver.min() > policy.validate.RUNS_ALIKE * driver.max()
        and samples.min() > policy.validate.RUNS_ALIKE * float(np.median(samples))
    )


def _judged(estimate: Estimate, data: Data, fold: Sequence[int], leaving: Sequence[Term] = ()) -> Squares:
    """Errors in the runs of a fold, by the model fitted to the others."""
    others = [i for i in range(len(data.histories)) if i not in fold]
    model, theta = fitted_to(estimate, data, others).less(*leaving)
    unseen = replace(_of(data, fold), with_rate=False)
    every = [np.ones(r.size, dtype=bool) for r in unseen.rows]
    return squares(model, with_tares(model, theta, unseen), unseen, every)


def fitted_to(estimate: Estimate, data: Data, runs: Sequence[int]) -> Fit:
    """The model fitted to some of the runs, by their numbers."""
    return _fitted(estimate, _of(data, runs), runs)


def _of(data: Data, runs: Sequence[int]) -> Data:
    histories = tuple(data.histories[i] for i in runs)
    return replace(data, histories=histories, keep=None, prior_factor=None, twin_factor=None)


def _fitted(estimate: Estimate, part: Data, runs: Sequence[int]) -> Fit:
    theta = replace(estimate.fit.theta, tares=tuple(estimate.fit.theta.tares[i] for i in runs))
    w = weights(part, estimate.noise, forces(estimate.fit.model, theta, part), estimate.rate_noise)
    return with_clocks_of(theta, fit(estimate.fit.model, theta, part, w), part, w)
