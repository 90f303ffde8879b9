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
FEW_TRIES = 2
"""The same where the slopes are not those of the place itself."""
LEAST_REACH = 0.05
"""sigma: a parameter that changes less within its bounds is left where it is."""
SLOW_FALLS = 3.0
"""Further falls of the last size that a fit may be short of what is hoped for."""
HARDER = 8.0
"""By how much the damping grows where a step is no better."""
LEAST_HARDER = 1e-2
"""Damping of a second try at least: beside slopes of size 1 a smaller one changes no step."""
LAST_LOOK = 1e-2
"""Of that fall: where slopes that were followed by secants are asked for at last, a step is tried that promises it."""
FALL_MET = 0.25
"""Of the fall that slopes foretold: where it was met as closely, they are not asked for anew before the next step."""
CLOSE = 1e-2
"""Fall of chi-square at which a fit has ended, or of which the slopes promise less; a difference of 1 is one sigma."""
MISFIT = 1e-2
"""Of chi-square per row: where it is more than 1, a fit has ended at as much more."""


@dataclass(frozen=True, eq=False, slots=True)
class Minimum:
    """Where the sum of squares is least, and what it was judged by there."""

    at: Floats
    """(p,)."""
    residual: Floats
    """(n,) whitened: measured less predicted."""
    slopes: Floats
    """(n, p) of the prediction, there or so near that the sum of squares is within CLOSE of the same."""
    given_up: bool = False
    """Ended early: what was hoped for is out of reach, and the slopes may be of a place before."""


def least_squares(
    residual_of: Callable[[Floats], Floats],
    slopes_of: Callable[[Floats], Floats],
    start: Floats,
    low: Floats,
    high: Floats,
    most_steps: int = MOST_STEPS,
    hopeless: float = np.inf,
    slopes: Floats | None = None,
) -> Minimum:
    """The least sum of squares of a whitened residual from one start (p,), within the bounds.

    `residual_of`: parameters (p,) to the residual (n,), measured less predicted; `slopes_of`: to the slopes (n, p) of
    the prediction, asked for `most_steps` times at most, only where the last step ended, and where that was not what
    they foretold; between they follow by secants. A parameter whose bounds are one stays where it is.
    `slopes`: (n, p) to begin with, which need not be quite those of the start.
    Ends early once the sum is above `hopeless` and falls too slowly to get there.
    """
    at = np.clip(start, low, high)
    residual, J = residual_of(at), slopes_of(at) if slopes is None else slopes
    damping, fresh, asked = 1e-3, slopes is None, 1
    while asked <= most_steps:
        chi2 = float(residual @ residual)
        close = CLOSE * max(1.0, MISFIT * chi2 / max(residual.size, 1))
        found = _step(residual_of, at, residual, J, low, high, damping, close, MOST_TRIES if fresh else FEW_TRIES)
        if found is None and fresh:
            break
        if found is None:  # by secants the end is only nearly met
            J, fresh, asked = slopes_of(at), True, asked + 1
            found = _step(residual_of, at, residual, J, low, high, damping, LAST_LOOK * close)
            if found is None:
                break
        fall = chi2 - float(found.residual @ found.residual)
        step, change = found.at - at, residual - found.residual
        at, residual = found.at, found.residual
        slow = chi2 - (1 + SLOW_FALLS) * fall > hopeless
        if slow and fresh:
            return Minimum(at, residual, J, given_up=True)
        damping = max(found.damping / 10, 1e-9)
        if fall < close and fresh:
            break
        if not slow and fall >= close and abs(fall - found.foretold) <= FALL_MET * found.foretold:
            J, fresh = _secant(J, step, change), False
        else:
            J, fresh, asked = slopes_of(at), True, asked + 1
    return Minimum(at, residual, J if fresh else slopes_of(at))


@dataclass(frozen=True, eq=False, slots=True)
class _Step:
    """Where the sum of squares is less, and how it was found."""

    at: Floats
    residual: Floats
    damping: float
    foretold: float
    """Fall that the slopes promised of it."""


def promised(found: Minimum, low: Floats, high: Floats, which: NDArray[np.bool_]) -> float:
    """By how much the slopes say that the sum of squares would fall, if the parameters `which` (p,) alone moved."""
    go = which & _movable(found.at, found.slopes, found.residual, low, high)
    J = found.slopes[:, go] / np.linalg.norm(found.slopes[:, go], axis=0)
    right = J.T @ found.residual
    return float(right @ np.linalg.lstsq(J.T @ J, right, rcond=1e-12)[0])


def _step(
    residual_of: Callable[[Floats], Floats],
    at: Floats,
    residual: Floats,
    J: Floats,
    low: Floats,
    high: Floats,
    damping: float,
    close: float,
    tries: int = MOST_TRIES,
) -> _Step | None:
    """None where there is nothing: no step is tried of which the slopes themselves promise less than `close`."""
    go = _movable(at, J, residual, low, high)
    size = np.linalg.norm(J[:, go], axis=0)
    A = J[:, go] / size
    gram, right = A.T @ A, A.T @ residual
    chi2 = float(residual @ residual)
    for _ in range(tries):
        step = np.linalg.solve(gram + damping * np.eye(gram.shape[0]), right)
        foretold = float(step @ (2 * right - gram @ step))
        if foretold < close:
            return None
        moved = at.copy()
        moved[go] += step / size
        trial = np.clip(moved, low, high)
        new = residual_of(trial)
        fall = chi2 - float(new @ new)
        if np.isfinite(fall) and fall > 0:
            return _Step(trial, new, damping, foretold)
        damping = max(HARDER * damping, LEAST_HARDER)
    return None


def _secant(J: Floats, moved: Floats, change: Floats) -> Floats:
    """(n, p) slopes that foretell the `change` (n,) of the prediction by what `moved` (p,), else as they were (Broyden,
    Math. Comp. 19, 577, 1965), each parameter in units of what it changes."""
    weight = moved * np.einsum("ij,ij->j", J, J)
    return J + np.outer(change - J @ moved, weight / float(moved @ weight))


def _movable(at: Floats, J: Floats, residual: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
    """(p,) parameters that are not pressed against a bound and change something within their bounds."""
    slope = J.T @ residual
    stuck = ((at <= low) & (slope < 0)) | ((at >= high) & (slope > 0))
    size = np.linalg.norm(J, axis=0)
    span = np.where(size > 0, high - low, 0.0)
    out: NDArray[np.bool_] = ~stuck & (size * span > LEAST_REACH)
    return out
