"""The solver: Levenberg's and Marquardt's steps within bounds, on any residual and its slopes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.recording import Floats

MOST_STEPS = 25
"""Steps of Levenberg and Marquardt: what needs more goes along a valley that tells nothing."""
MOST_TRIES = 8
"""Dampings tried for one step."""
LEAST_REACH = 0.05
"""sigma: a parameter that changes less within its bounds is left where it is."""
SLOW_FALLS = 3.0
"""Further falls of the last size that a fit may be short of what is hoped for."""
CLOSE = 1e-4
"""Fall of chi-square at which a fit has ended; a difference of 1 is one sigma."""


@dataclass(frozen=True, eq=False, slots=True)
class Minimum:
    """Where the sum of squares is least, and what it was judged by there."""

    at: Floats
    """(p,)."""
    residual: Floats
    """(n,) whitened: measured less predicted."""
    slopes: Floats
    """(n, p) of the prediction."""


def least_squares(
    residual_of: Callable[[Floats], Floats],
    slopes_of: Callable[[Floats], Floats],
    start: Floats,
    low: Floats,
    high: Floats,
    most_steps: int = MOST_STEPS,
    hopeless: float = np.inf,
) -> Minimum:
    """The least sum of squares of a whitened residual from one start (p,), within the bounds.

    `residual_of`: parameters (p,) to the residual (n,), measured less predicted; `slopes_of`: to the slopes (n, p) of
    the prediction, asked for only where the last step ended. A parameter whose bounds are one stays where it is.
    Ends early once the sum is above `hopeless` and falls too slowly to get there.
    """
    at = np.clip(start, low, high)
    residual, J = residual_of(at), slopes_of(at)
    damping = 1e-3
    for _ in range(most_steps):
        go = _movable(at, J, residual, low, high)
        size = np.linalg.norm(J[:, go], axis=0)
        A = J[:, go] / size
        gram, right = A.T @ A, A.T @ residual
        chi2 = float(residual @ residual)
        for _ in range(MOST_TRIES):
            moved = at.copy()
            moved[go] += np.linalg.solve(gram + damping * np.eye(gram.shape[0]), right) / size
            trial = np.clip(moved, low, high)
            new = residual_of(trial)
            fall = chi2 - float(new @ new)
            if np.isfinite(fall) and fall > 0:
                break
            damping = max(damping, 1e-6) * 8
        else:
            break
        at, residual = trial, new
        if chi2 - (1 + SLOW_FALLS) * fall > hopeless:
            break
        damping = max(damping / 10, 1e-9)
        J = slopes_of(at)
        if fall < CLOSE * max(1.0, 1e-3 * chi2 / max(residual.size, 1)):
            break
    return Minimum(at, residual, J)


def _movable(at: Floats, J: Floats, residual: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
    """(p,) parameters that are not pressed against a bound and change something within their bounds."""
    slope = J.T @ residual
    stuck = ((at <= low) & (slope < 0)) | ((at >= high) & (slope > 0))
    size = np.linalg.norm(J, axis=0)
    span = np.where(size > 0, high - low, 0.0)
    out: NDArray[np.bool_] = ~stuck & (size * span > LEAST_REACH)
    return out
