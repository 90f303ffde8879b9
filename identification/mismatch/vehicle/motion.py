"""A vehicle's motion under given forces, and what small forces change of it, all steps of a run solved at once.

The midpoint rule makes m (v' - v)/h = push - drag at the middle of each step one banded system for a whole run: Newton's
iterations and every sensitivity are banded solutions, without a loop over steps. Its error is of order (h/T)^2/12 for a
vehicle of time constant T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from identification.mismatch.vehicle.runs import Run
from identification.physics.vehicle.term import Body
from identification.recording import Floats

MOST_ITERATIONS = 60
SAME = 1e-9
"""Of the largest speed: where Newton's iterations end."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Velocity over ground and position at the g + 1 edges of the grid."""

    v: Floats
    x: Floats


@dataclass(frozen=True, eq=False)
class Slopes:
    """The linearised equations of motion along a trajectory, banded."""

    bands: Floats
    """(5, 2g), one band above the diagonal and three below."""
    first: Floats
    """(2g, 2): what velocity and position at the start put into the equations."""


def drag(body: Body, v: Floats, x: Floats, origin: float) -> tuple[Floats, Floats, Floats]:
    """N that oppose the motion at each step, and their slopes over v and x; v, x (g,) at the middle of the steps."""
    r = v - body.water
    out = x - origin
    square = body.quadratic * np.where(r < 0, body.astern, 1.0) + body.line_drag * np.abs(out)
    force = body.linear * r + square * np.abs(r) * r + body.line_pull * out
    over_v = body.linear + 2 * square * np.abs(r)
    over_x = body.line_drag * np.sign(out) * np.abs(r) * r + body.line_pull
    return force, over_v, over_x


def left_over(body: Body, push: Floats, motion: Motion, step: float, origin: float) -> Floats:
    """(g,) N by which the equation of motion is not met."""
    v, x = motion.v, motion.x
    force, _, _ = drag(body, 0.5 * (v[1:] + v[:-1]), 0.5 * (x[1:] + x[:-1]), origin)
    out: Floats = body.mass / step * np.diff(v) + force - push - body.steady
    return out


def linearised(body: Body, motion: Motion, step: float, origin: float) -> Slopes:
    """Unknowns are v1, x1, v2, x2 ...; equations: the step's force balance, then x' - x = h (v + v')/2."""
    v, x = motion.v, motion.x
    _, over_v, over_x = drag(body, 0.5 * (v[1:] + v[:-1]), 0.5 * (x[1:] + x[:-1]), origin)
    g = v.size - 1
    ahead, behind = body.mass / step + 0.5 * over_v, -body.mass / step + 0.5 * over_v
    bands = np.zeros((5, 2 * g))
    # bands[1 + row - column, column]
    bands[1, 0::2], bands[1, 1::2] = ahead, 1.0
    bands[0, 1::2] = 0.5 * over_x
    bands[2, 0::2] = -0.5 * step
    bands[2, 1:-1:2] = 0.5 * over_x[1:]
    bands[3, 0:-2:2] = behind[1:]
    bands[3, 1:-1:2] = -1.0
    bands[4, 0:-2:2] = -0.5 * step
    first = np.zeros((2 * g, 2))
    first[0] = behind[0], 0.5 * over_x[0]
    first[1] = -0.5 * step, -1.0
    return Slopes(bands, first)


def solved(slopes: Slopes, forces: Floats) -> tuple[Floats, Floats]:
    """Change of v and x (g, p) at the ends of the steps under small added forces (g, p)."""
    right = np.zeros((slopes.bands.shape[1], forces.shape[1]))
    right[0::2] = forces
    return _pair(slopes, right)


def from_start(slopes: Slopes) -> tuple[Floats, Floats]:
    """Change of v and x (g, 2) at the ends of the steps for a unit of velocity, and of position, at the start."""
    return _pair(slopes, -slopes.first)


def _pair(slopes: Slopes, right: Floats) -> tuple[Floats, Floats]:
    found = solve_banded((3, 1), slopes.bands, right, check_finite=False)
    return found[0::2], found[1::2]


def moved(body: Body, push: Floats, step: float, v0: float, x0: float, origin: float, guess: Floats | None) -> Motion:
    """The motion from (v0, x0) under push (g,) N; `guess` (g + 1,) of the velocity, where one is at hand."""
    g = push.size
    v = np.full(g + 1, v0) if guess is None else np.append(v0, guess[1:])
    x = x0 + np.append(0.0, np.cumsum(0.5 * step * (v[1:] + v[:-1])))
    for _ in range(MOST_ITERATIONS):
        now = Motion(v, x)
        dv, dx = solved(linearised(body, now, step, origin), -left_over(body, push, now, step, origin)[:, None])
        v, x = v.copy(), x.copy()
        v[1:] += dv[:, 0]
        x[1:] += dx[:, 0]
        if float(np.abs(dv).max()) <= SAME * (float(np.abs(v).max()) + 1e-12):
            break
    return Motion(v, x)


def observed(run: Run, v: Floats, x: Floats) -> Floats:
    """What is measured of v, x (g + 1, ...) at the rows of a run: a cubic through positions and velocities."""
    h = run.moment.step
    at = np.clip((run.time - run.start) / h, 0.0, run.steps)
    i = np.minimum(at.astype(np.intp), run.steps - 1)
    s = (at - i).reshape((-1,) + (1,) * (v.ndim - 1))
    if run.quantity == "speed":
        return (1 - s) * v[i] + s * v[i + 1]
    out: Floats = (
        (1 + 2 * s) * (1 - s) ** 2 * x[i]
        + s * (1 - s) ** 2 * h * v[i]
        + s**2 * (3 - 2 * s) * x[i + 1]
        + s**2 * (s - 1) * h * v[i + 1]
    )
    return out
