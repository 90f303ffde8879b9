"""Least squares of a vehicle's model on its whitened residual, within physical bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.estimation.singular_values import thin_svd
from identification.mismatch.estimate.at_bounds import impossible
from identification.mismatch.estimate.bounded_least_squares import MOST_STEPS, Minimum, least_squares
from identification.mismatch.estimate.estimate import independent
from identification.mismatch.model.whitening import Weights
from identification.mismatch.noise.covariance import Noise, Rows, Shapes, Whitener
from identification.mismatch.noise.variances import fit_noise
from identification.mismatch.vehicle.model import Layout, Prediction, known, predict
from identification.mismatch.vehicle.motion import Motion
from identification.mismatch.vehicle.runs import Prepared
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Floats

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters and everything at them."""

    layout: Layout
    theta: Floats
    residual: Floats
    """(N + q,) whitened: all runs, then what was known."""
    jacobian: Floats
    """(N + q, p) whitened, of the prediction."""
    motions: tuple[Motion, ...]
    predicted: tuple[Floats, ...]
    cov: Floats
    """(p, p); columns at a bound are taken as fixed there: 0."""
    free: Mask
    """(p,) not at a bound."""

    @property
    def chi2(self) -> float:
        """Of whitened measurements and of what was known beforehand."""
        return float(self.residual @ self.residual)

    @property
    def values(self) -> dict[VehicleTerm, tuple[float, ...]]:
        """The values of each term."""
        return self.layout.values(self.theta)

    @property
    def std(self) -> Floats:
        """(p,) standard errors, NaN where they are not determined."""
        return np.sqrt(np.diag(self.cov))


def weights(noise: Noise, data: Prepared, keep: Sequence[Mask] | None = None) -> Weights:
    """One whitening for each run, of the rows in `keep` alone where it is given."""
    kept = [run.rows if keep is None else _part(run.rows, keep[j]) for j, run in enumerate(data.runs)]
    shapes = Shapes()
    return Weights(tuple(Whitener(noise, rows, np.zeros(rows.time.size), shapes) for rows in kept))


def _part(rows: Rows, on: Mask) -> Rows:
    return Rows(rows.time[on], rows.count[on], rows.extra[on], rows.width[on])


class _Problem:
    """What the solver asks of a vehicle's model: its whitened residual and slopes; motions begin near the last."""

    def __init__(
        self,
        layout: Layout,
        data: Prepared,
        white: Weights,
        guess: Sequence[Motion] | None,
        keep: Sequence[Mask] | None,
    ) -> None:
        self.layout, self.data, self.white = layout, data, white
        self.guess: Sequence[Motion | None] = guess or [None] * len(data.runs)
        self.rows = keep or [np.ones(run.time.size, dtype=bool) for run in data.runs]
        self.told = known(layout, data)

    def predicted(self, theta: Floats, *, slopes: bool = False) -> list[Prediction]:
        """All runs."""
        return [predict(self.layout, theta, self.data, j, near, slopes) for j, near in enumerate(self.guess)]

    def residual(self, theta: Floats) -> Floats:
        """(N + q,) whitened: all runs, then what was known."""
        left = [run.response - one.response for run, one in zip(self.data.runs, self.predicted(theta), strict=True)]
        left = [np.nan_to_num(r, nan=1e6, posinf=1e6, neginf=-1e6)[on] for r, on in zip(left, self.rows, strict=True)]
        return self.white.whiten(left, [], [self.told.right - self.told.rows @ theta])

    def slopes(self, theta: Floats) -> Floats:
        """(N + q, p) of the same; the motions there are where the next ones begin."""
        found = self.predicted(theta, slopes=True)
        self.guess = [one.motion for one in found]
        return self.white.whiten(
            [one.slopes[on] for one, on in zip(found, self.rows, strict=True)], [], [self.told.rows]
        )


def fit(
    layout: Layout,
    theta: Floats,
    data: Prepared,
    white: Weights,
    guess: Sequence[Motion] | None = None,
    keep: Sequence[Mask] | None = None,
    steps: int = MOST_STEPS,
    fixed: Floats | None = None,
) -> Fit:
    """Least squares of the whitened residual within the physical bounds.

    `keep` (n,) per run: which rows are fitted; `white` must then be made of those rows.
    `fixed` (p,): parameters above 0 keep their values.
    """
    low, high = layout.bounds()
    theta = np.clip(theta, low, high)
    if fixed is not None:
        low, high = np.where(fixed > 0, theta, low), np.where(fixed > 0, theta, high)
    problem = _Problem(layout, data, white, guess, keep)
    found = least_squares(problem.residual, problem.slopes, theta, low, high, steps)
    there = problem.predicted(found.at)
    free = ~_stuck(found, low, high)
    return Fit(
        layout,
        found.at,
        found.residual,
        found.slopes,
        tuple(one.motion for one in there),
        tuple(one.response for one in there),
        _cov(found.slopes, free),
        free,
    )


def _stuck(found: Minimum, low: Floats, high: Floats) -> Mask:
    """(p,) at a bound, and the data would push it on."""
    downhill = found.slopes.T @ found.residual
    out: Mask = ((found.at <= low) & (downhill <= 0)) | ((found.at >= high) & (downhill >= 0)) | (low >= high)
    return out


def _cov(H: Floats, free: Mask) -> Floats:
    out = np.zeros((H.shape[1], H.shape[1]))
    at = np.flatnonzero(free)
    size = np.sqrt(np.sum(H[:, at] ** 2, axis=0))
    size[size == 0] = 1.0
    _, s, Vt = thin_svd(H[:, at] / size)
    kept = s > 1e-9 * s.max() if s.size else s > 0
    inside = (Vt[kept].T / s[kept] ** 2) @ Vt[kept]
    out[np.ix_(at, at)] = inside / np.outer(size, size)
    unseen = np.sum(Vt[~kept] ** 2, axis=0) > 1e-6
    out[at[unseen], at[unseen]] = np.nan
    return out


def at_bound(fitted: Fit, term: VehicleTerm) -> bool:
    """Whether the parameters of a term end at what is physically possible."""
    return impossible(fitted.layout.parts[term], fitted.values[term])


def noise_of(fitted: Fit, data: Prepared, extra: Sequence[Floats] | None = None) -> Noise:
    """Noise of the residual by restricted likelihood; `extra` (n, q) per run: further columns that it must not hold."""
    residuals, columns = [], []
    for j, run in enumerate(data.runs):
        one = predict(fitted.layout, fitted.theta, data, j, fitted.motions[j], slopes=True)
        residuals.append(run.response - one.response)
        columns.append(one.slopes if extra is None else np.hstack([one.slopes, extra[j]]))
    columns = independent(columns)
    nothing = [np.zeros(r.size) for r in residuals]
    return fit_noise([run.rows for run in data.runs], residuals, columns, nothing)
