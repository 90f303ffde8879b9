"""The uncoupled vehicle m xi' = -k xi - k2 |xi| xi + tau (eq. 4.13) simulated for many parameter sets at once.

xi is the velocity through the water; a uniform current adds to the velocity over ground. Buoyancy (heave) is a
constant force. Runge and Kutta's fourth-order rule; in each step the force is a straight line with the mean that the
trial gives and the slope of its neighbours (a constant one puts the vehicle off by (change of force / m) h^2/12).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.recording import Floats
from identification.vehicle.trials import Trial

HEAVY = 1e-9
"""kg: inertia below which a trial step of an optimiser is no vehicle."""
RUNAWAY = 1e6
"""m or m/s: farther and faster no vehicle goes."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Position and velocity over ground at the measurements of a trial; (k, n) for k parameter sets."""

    position: Floats
    velocity: Floats


def drag_slope(xi: Floats, push: Floats, k: Floats, k2: Floats, m: Floats) -> Floats:
    """The acceleration of eq. 4.13."""
    out: Floats = (push - (k + k2 * np.abs(xi)) * xi) / m
    return out


def integrate(
    push: Floats,
    step: float,
    xi0: Floats,
    k: Floats,
    k2: Floats,
    m: Floats,
    drift: Floats,
    half: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Velocity through the water and distance over ground (k, g + 1) at the ends of g steps; `push` (k, g) N.

    `half` (k, g): change of the force within half a step, by default as neighbouring steps have it.

    >>> one = np.ones(1)
    >>> xi, x = integrate(np.full((1, 100), 8.0), 0.1, 0 * one, 2 * one, 0 * one, 4 * one, 0 * one)
    >>> bool(abs(xi[0, -1] - 4 * (1 - np.exp(-5.0))) < 1e-6), bool(abs(x[0, -1] - (40 - 2 * xi[0, -1])) < 1e-6)
    (True, True)
    """
    count, steps = push.shape
    half = half_change(push) if half is None else half
    xi, x = np.empty((steps + 1, count)), np.zeros((steps + 1, count))
    xi[0] = v = np.asarray(xi0, dtype=np.float64)
    m = np.maximum(m, HEAVY)
    with np.errstate(over="ignore", invalid="ignore"):
        for i in range(steps):
            p, q = push[:, i], half[:, i]
            a = drag_slope(v, p - q, k, k2, m)
            v2 = v + 0.5 * step * a
            b = drag_slope(v2, p, k, k2, m)
            v3 = v + 0.5 * step * b
            c = drag_slope(v3, p, k, k2, m)
            v4 = v + step * c
            x[i + 1] = x[i] + step / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v = v + step / 6 * (a + 2 * b + 2 * c + drag_slope(v4, p + q, k, k2, m))
            xi[i + 1] = v
    far = x + drift * step * np.arange(steps + 1)[:, None]
    return _bounded(xi.T), _bounded(far.T)


def half_change(push: Floats) -> Floats:
    """Change of a force (k, g) within half a step, from its neighbours."""
    out: Floats = 0.5 * np.gradient(push, axis=1) if push.shape[1] > 1 else np.zeros(push.shape)
    return out


def _bounded(y: Floats) -> Floats:
    """What ran away in a trial step of an optimiser stays a number that can be squared."""
    out: Floats = np.clip(np.nan_to_num(y, nan=RUNAWAY), -RUNAWAY, RUNAWAY)
    return out


def column(names: Sequence[str], theta: Floats, name: str, default: float) -> Floats:
    """(k,) values of one parameter in sets theta (k, p)."""
    return theta[:, list(names).index(name)] if name in names else np.full(theta.shape[0], default)


def current_along(names: Sequence[str], theta: Floats, axis: str, heading: float) -> Floats:
    """(k,) m/s of the uniform current along an axis: `current_north`, `current_east` turned by the heading.

    Without a recorded heading the recording is taken to look along heading 0. Yaw and heave feel none.
    """
    if axis not in ("surge", "sway"):
        return np.zeros(theta.shape[0])
    psi = heading if np.isfinite(heading) else 0.0
    north, east = column(names, theta, "current_north", 0.0), column(names, theta, "current_east", 0.0)
    if axis == "surge":
        return np.asarray(north * np.cos(psi) + east * np.sin(psi))
    return np.asarray(east * np.cos(psi) - north * np.sin(psi))


def simulate(
    trial: Trial, names: Sequence[str], theta: Floats, buoyancy: str = "", state: tuple[str, str] = ("x0", "v0")
) -> Motion:
    """Motion of k vehicles theta (k, p) in one trial.

    Parameters by name: m, k, k2, efficiencies, thruster coefficients, current_north, current_east, the one that
    `buoyancy` names, and the position and velocity over ground at the start (`state`); what is absent is 0 (m: 1).
    """
    return simulate_all([trial], names, theta, [buoyancy], [state])[0]


def simulate_all(
    trials: Sequence[Trial],
    names: Sequence[str],
    theta: Floats,
    buoyancies: Sequence[str],
    states: Sequence[tuple[str, str]],
) -> list[Motion]:
    """`simulate` of several trials, those of one grid step in one sweep."""
    found: dict[int, Motion] = {}
    for step in dict.fromkeys(one.step for one in trials):
        chosen = [i for i, one in enumerate(trials) if one.step == step]
        parts = [_prepared(trials[i], names, theta, buoyancies[i], states[i]) for i in chosen]
        longest = max(part.push.shape[1] for part in parts)
        push, half = (np.vstack([_padded(x, longest) for x in xs]) for xs in zip(*map(_forces, parts), strict=True))
        xi0, drift = np.hstack([part.xi0 for part in parts]), np.hstack([part.drift for part in parts])
        k, k2, m = (
            np.tile(column(names, theta, name, value), len(parts))
            for name, value in (("k", 0.0), ("k2", 0.0), ("m", 1.0))
        )
        xi, x = integrate(push, step, xi0, k, k2, m, drift, half)
        sets = theta.shape[0]
        for j, (i, part) in enumerate(zip(chosen, parts, strict=True)):
            rows, cols = slice(j * sets, (j + 1) * sets), slice(part.push.shape[1] + 1)
            v, place = xi[rows, cols] + part.drift[:, None], x[rows, cols] + part.x0[:, None]
            found[i] = Motion(*_at_measurements(trials[i], v, place))
    return [found[i] for i in range(len(trials))]


@dataclass(frozen=True, eq=False)
class _Prepared:
    """One trial of k vehicles before the sweep."""

    push: Floats
    """(k, g)"""
    xi0: Floats
    drift: Floats
    x0: Floats


def _prepared(trial: Trial, names: Sequence[str], theta: Floats, buoyancy: str, state: tuple[str, str]) -> _Prepared:
    weights = trial.force.weights(names, theta)
    push = weights @ trial.force.signal + column(names, theta, buoyancy, 0.0)[:, None]
    drift = current_along(names, theta, trial.axis, trial.heading)
    xi0 = column(names, theta, state[1], 0.0) - drift
    return _Prepared(push, xi0, drift, column(names, theta, state[0], 0.0))


def _forces(part: _Prepared) -> tuple[Floats, Floats]:
    return part.push, half_change(part.push)


def _padded(x: Floats, steps: int) -> Floats:
    return np.pad(x, ((0, 0), (0, steps - x.shape[1])))


def _at_measurements(trial: Trial, v: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Cubic through positions and velocities of both ends of a step (Hermite); velocity on a straight line."""
    at = (trial.time - trial.start) / trial.step
    i = np.clip(at.astype(np.intp), 0, x.shape[1] - 2)
    s = at - i
    h = trial.step
    position = (
        (1 + 2 * s) * (1 - s) ** 2 * x[:, i]
        + s * (1 - s) ** 2 * h * v[:, i]
        + s**2 * (3 - 2 * s) * x[:, i + 1]
        + s**2 * (s - 1) * h * v[:, i + 1]
    )
    return position, (1 - s) * v[:, i] + s * v[:, i + 1]
