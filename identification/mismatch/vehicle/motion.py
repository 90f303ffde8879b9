"""A vehicle's motion under given forces, and what small forces change of it, all steps of a run solved at once.

The midpoint rule makes m (v' - v)/h = push - drag, at the middle of each step, one banded system for a whole run:
Newton's iterations and every sensitivity are banded solutions, without a loop over steps. Its error is of
order (h/T)^2/12 for a vehicle of time constant T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from identification.mismatch.vehicle.runs import Run
from identification.physics.vehicle.term import Body
from identification.recording import Floats

MOST_ITERATIONS = 60
"""Newton iterations over the whole motion, at most: they end by SAME."""
SAME = 1e-9
"""Of the largest speed: where Newton's iterations end."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Velocity over ground and position at the g + 1 edges of the grid."""

    v: Floats
    x: Floats


@dataclass(frozen=True, eq=False)
class Slopes:
    """The linearised equations of motion along a trajectory, banded: of v alone, or of v and x where a line pulls."""

    bands: Floats
    """(2, g): the diagonal and the band below; or (5, 2g): one band above the diagonal and three below."""
    first: Floats
    """(g, 2) or (2g, 2): what velocity and position at the start put into the equations."""
    step: float

    @property
    def alone(self) -> bool:
        return len(self.bands) == 2


def drag(body: Body, v: Floats, x: Floats, origin: float) -> tuple[Floats, Floats, Floats]:
    """N that oppose the motion at each step, and their slopes over v and x; v, x (g,) at the middle of the steps."""
    r = v - body.water
    size = np.abs(r)
    square: Floats | float = body.quadratic
    if body.astern != 1:
        square = body.quadratic * np.where(r < 0, body.astern, 1.0)
    if not _lined(body):
        return (body.linear + square * size) * r, body.linear + 2 * square * size, np.zeros(1)
    out = x - origin
    square = square + body.line_drag * np.abs(out)
    force = (body.linear + square * size) * r + body.line_pull * out
    over_x = body.line_drag * np.sign(out) * size * r + body.line_pull
    return force, body.linear + 2 * square * size, over_x


def _lined(body: Body) -> bool:
    return body.line_drag != 0 or body.line_pull != 0


def _middle(y: Floats) -> Floats:
    out: Floats = 0.5 * (y[1:] + y[:-1])
    return out


def left_over(body: Body, push: Floats, motion: Motion, step: float, origin: float) -> Floats:
    """(g,) N by which the equation of motion is not met."""
    force, _, _ = drag(body, _middle(motion.v), _middle(motion.x), origin)
    out: Floats = body.mass / step * (motion.v[1:] - motion.v[:-1]) + force - push - body.steady
    return out


def linearised(body: Body, motion: Motion, step: float, origin: float) -> Slopes:
    """Unknowns are v1, x1, v2, x2 ...; equations: the step's force balance, then x' - x = h (v + v')/2.

    Without a line the first half is enough: position is what velocity adds up to.
    """
    _, over_v, over_x = drag(body, _middle(motion.v), _middle(motion.x), origin)
    g = motion.v.size - 1
    ahead, behind = body.mass / step + 0.5 * over_v, -body.mass / step + 0.5 * over_v
    if not _lined(body):
        bands = np.zeros((2, g))
        bands[0], bands[1, :-1] = ahead, behind[1:]
        first = np.zeros((g, 2))
        first[0, 0] = behind[0]
        return Slopes(bands, first, step)
    bands = np.zeros((5, 2 * g))
    # the element of (row, column) stands in bands at 1 + row - column
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
    return Slopes(bands, first, step)


def changes(slopes: Slopes, forces: Floats) -> tuple[Floats, Floats]:
    """Change of v and x (g + 1, p + 2) at the edges: under small added forces (g, p), and for v and x at the start."""
    p = forces.shape[1]
    begin = np.zeros((2, 1, p + 2))
    begin[0, 0, p], begin[1, 0, p + 1] = 1.0, 1.0
    if slopes.alone:
        dv = solve_banded((1, 0), slopes.bands, np.hstack([forces, -slopes.first]), check_finite=False)
        v = np.vstack([begin[0], dv])
        way = np.cumsum(0.5 * slopes.step * (v[1:] + v[:-1]), axis=0)
        return v, np.vstack([begin[1], begin[1] + way])
    right = np.zeros((slopes.bands.shape[1], p + 2))
    right[0::2, :p] = forces
    right[:, p:] = -slopes.first
    found = solve_banded((3, 1), slopes.bands, right, check_finite=False)
    return np.vstack([begin[0], found[0::2]]), np.vstack([begin[1], found[1::2]])


def moved(body: Body, push: Floats, step: float, v0: float, x0: float, origin: float, guess: Floats | None) -> Motion:
    """The motion from (v0, x0) under push (g,) N; `guess` (g + 1,) of the velocity, where one is at hand."""
    g = push.size
    v = np.full(g + 1, v0) if guess is None else np.append(v0, guess[1:])
    x = x0 + np.append(0.0, np.cumsum(0.5 * step * (v[1:] + v[:-1])))
    for _ in range(MOST_ITERATIONS):
        now = Motion(v, x)
        slopes = linearised(body, now, step, origin)
        dv, dx = changes(slopes, -left_over(body, push, now, step, origin)[:, None])
        v, x = v + dv[:, 0], x + dx[:, 0]
        if float(np.abs(dv[:, 0]).max()) <= SAME * (float(np.abs(v).max()) + 1e-12):
            break
    return Motion(v, x)


def observed(run: Run, v: Floats, x: Floats) -> Floats:
    """What is measured of v, x (g + 1, ...) at the rows of a run: a cubic through positions and velocities."""
    h = run.moment.step
    at = np.clip((run.time - run.start) / h, 0.0, run.steps)
    i = np.minimum(at.astype(np.intp), run.steps - 1)
    s = (at - i).reshape((-1,) + (1,) * (v.ndim - 1))
    if run.quantity == "speed":
        straight: Floats = (1 - s) * v[i] + s * v[i + 1]
        return straight
    out: Floats = (
        (1 + 2 * s) * (1 - s) ** 2 * x[i]
        + s * (1 - s) ** 2 * h * v[i]
        + s**2 * (3 - 2 * s) * x[i + 1]
        + s**2 * (s - 1) * h * v[i + 1]
    )
    return out
