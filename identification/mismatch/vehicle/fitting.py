"""Least squares of a vehicle's model on its whitened residual, within physical bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.estimation.singular_values import thin_svd
from identification.mismatch.noise.covariance import Noise, Rows, Shapes, Whitener
from identification.mismatch.noise.variances import fit_noise
from identification.mismatch.vehicle.model import Known, Layout, known, predict
from identification.mismatch.vehicle.motion import Motion
from identification.mismatch.vehicle.runs import Prepared
from identification.recording import Floats

STEPS = 30
"""Steps of Levenberg and Marquardt: what needs more goes along a valley that tells nothing."""
ENOUGH = 1e-3
"""Change of chi-square below which a fit has arrived."""
DAMPING = 1e-3
"""Of the first step, in units of the columns' squares."""
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Fit:
    """Parameters and everything at them."""

    layout: Layout
    theta: Floats
    chi2: float
    """Of whitened measurements and of what was known beforehand."""
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


Weights = tuple[Whitener, ...]


def weights(noise: Noise, data: Prepared, keep: Sequence[Floats] | None = None) -> Weights:
    """One whitening for each run, of the rows in `keep` alone where it is given."""
    kept = [run.rows if keep is None else _part(run.rows, keep[j]) for j, run in enumerate(data.runs)]
    shapes = Shapes()
    return tuple(Whitener(noise, rows, np.zeros(rows.time.size), shapes) for rows in kept)


def _part(rows: Rows, keep: Floats) -> Rows:
    on = keep > 0
    return Rows(rows.time[on], rows.count[on], rows.extra[on], rows.width[on])


@dataclass(frozen=True, eq=False)
class _At:
    chi2: float
    residual: Floats
    jacobian: Floats
    motions: tuple[Motion, ...]
    predicted: tuple[Floats, ...]


def _at(
    layout: Layout,
    theta: Floats,
    data: Prepared,
    white: Weights,
    told: Known,
    keep: Sequence[Floats] | None,
    guess: Sequence[Motion] | None,
    slopes: bool,
) -> _At:
    rs, Hs, motions, predicted = [], [], [], []
    for j, run in enumerate(data.runs):
        one = predict(layout, theta, data, j, None if guess is None else guess[j], slopes)
        r, H = run.response - one.response, one.slopes
        r = np.nan_to_num(r, nan=1e6, posinf=1e6, neginf=-1e6)
        if keep is not None:
            r, H = r[keep[j] > 0], H[keep[j] > 0]
        rs.append(white[j].whiten(r))
        Hs.append(white[j].whiten(H) if slopes else H)
        motions.append(one.motion)
        predicted.append(one.response)
    rs.append(told.right - told.rows @ theta)
    Hs.append(told.rows if slopes else np.empty((told.right.size, 0)))
    residual = np.concatenate(rs)
    return _At(float(residual @ residual), residual, np.vstack(Hs), tuple(motions), tuple(predicted))


def fit(
    layout: Layout,
    theta: Floats,
    data: Prepared,
    white: Weights,
    guess: Sequence[Motion] | None = None,
    keep: Sequence[Floats] | None = None,
    steps: int = STEPS,
    fixed: Floats | None = None,
) -> Fit:
    """Gauss and Newton's steps with damping; a parameter that would leave its bounds stays there for the step.

    `keep` (n,) per run: rows above 0 are fitted; `white` must then be made of those rows.
    `fixed` (p,): parameters above 0 keep their values.
    """
    low, high = layout.bounds()
    theta = np.clip(theta, low, high)
    if fixed is not None:
        low, high = np.where(fixed > 0, theta, low), np.where(fixed > 0, theta, high)
    told = known(layout, data)
    now = _at(layout, theta, data, white, told, keep, guess, slopes=True)
    damping = DAMPING
    for _ in range(steps):
        step = _step(now, theta, low, high, damping)
        new_theta = np.clip(theta + step, low, high)
        new = _at(layout, new_theta, data, white, told, keep, now.motions, slopes=False)
        if new.chi2 < now.chi2:
            gained = now.chi2 - new.chi2
            theta, damping = new_theta, max(damping / 5, 1e-9)
            now = _at(layout, theta, data, white, told, keep, new.motions, slopes=True)
            if gained < ENOUGH * (1 + 1e-4 * now.chi2):
                break
        elif damping > 1e6 or float(np.abs(step).max()) == 0:
            break
        else:
            damping = max(10 * damping, 1e-4)
    free = ~_stuck(now, theta, low, high)
    return Fit(
        layout, theta, now.chi2, now.residual, now.jacobian, now.motions, now.predicted, _cov(now.jacobian, free), free
    )


def _stuck(now: _At, theta: Floats, low: Floats, high: Floats) -> Mask:
    """(p,) at a bound, and the data would push it on."""
    downhill = now.jacobian.T @ now.residual
    out: Mask = ((theta <= low) & (downhill <= 0)) | ((theta >= high) & (downhill >= 0)) | (low >= high)
    return out


def _step(now: _At, theta: Floats, low: Floats, high: Floats, damping: float) -> Floats:
    step = np.zeros(theta.size)
    free = ~_stuck(now, theta, low, high)
    for _ in range(3):  # what a step takes to a bound stays there, the others go on
        H = now.jacobian[:, free]
        size = np.sqrt(np.sum(H**2, axis=0))
        size[size == 0] = 1.0
        left = now.residual - now.jacobian[:, ~free] @ step[~free]
        A = np.vstack([H / size, np.sqrt(damping) * np.eye(H.shape[1])])
        found, *_ = np.linalg.lstsq(A, np.append(left, np.zeros(H.shape[1])), rcond=1e-12)
        step[free] = found / size
        beyond = free & ((theta + step < low) | (theta + step > high))
        if not beyond.any():
            break
        step[beyond] = np.clip(theta[beyond] + step[beyond], low[beyond], high[beyond]) - theta[beyond]
        free = free & ~beyond
    return step


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


def noise_of(fitted: Fit, data: Prepared, extra: Sequence[Floats] | None = None) -> Noise:
    """Noise of the residual by restricted likelihood; `extra` (n, q) per run: further columns that it must not hold."""
    residuals, columns = [], []
    for j, run in enumerate(data.runs):
        one = predict(fitted.layout, fitted.theta, data, j, fitted.motions[j], slopes=True)
        residuals.append(run.response - one.response)
        columns.append(one.slopes if extra is None else np.hstack([one.slopes, extra[j]]))
    columns = _independent(columns)
    nothing = [np.zeros(r.size) for r in residuals]
    return fit_noise([run.rows for run in data.runs], residuals, columns, nothing)


def _independent(columns: Sequence[Floats]) -> list[Floats]:
    """The same space in columns at right angles: what repeats another is left out."""
    whole = np.vstack(columns)
    size = np.sqrt(np.sum(whole**2, axis=0))
    whole = whole[:, size > 0] / size[size > 0]
    U, s, _ = thin_svd(whole)
    basis = U[:, s > 1e-7 * s.max()] if s.size else U
    ends = np.cumsum([c.shape[0] for c in columns])[:-1]
    return [np.ascontiguousarray(part) for part in np.split(basis, ends)]
