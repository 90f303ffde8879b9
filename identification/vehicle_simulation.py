"""The uncoupled vehicle m xi' = -k xi - k2 |xi| xi + tau (eq. 4.13) simulated for many parameter sets at once.

xi is the velocity through the water; a uniform current adds to the velocity over ground. Buoyancy (heave) is a
constant force. Runge and Kutta's fourth-order rule; in each step the force is a straight line with the mean that the
trial gives and the slope of its neighbours (a constant one puts the vehicle off by (change of force / m) h^2/12).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.maximum_likelihood import Gaussian
from identification.recording import Floats
from identification.vehicle_trials import Trial

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


@dataclass(frozen=True, slots=True)
class Validation:
    """An identified vehicle against one trial."""

    recording_id: str
    quantity: str
    rmse: float
    """Unit of the measurement."""
    fit: float
    """%: 100 (1 - |y - y_hat| / |y - mean y|); 0 is as good as the mean of the measurements."""

    @property
    def statement(self) -> str:
        return f"{self.recording_id}: simulated {self.quantity} is off by {self.rmse:.3g} rms, fit {self.fit:.1f} %"


def fit_percent(measured: Floats, simulated: Floats) -> float:
    """Normalised root mean square fit, %.

    >>> fit_percent(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0]))
    100.0
    """
    power = float(np.linalg.norm(measured - measured.mean()))
    return 100 * (1 - float(np.linalg.norm(measured - simulated)) / power) if power > 0 else float("nan")


@dataclass(frozen=True, eq=False)
class Replay:
    """One trial as measured and as the identified vehicle does it, (n,)."""

    recording_id: str
    quantity: str
    time: Floats
    measured: Floats
    simulated: Floats

    @property
    def validation(self) -> Validation:
        rmse = float(np.sqrt(np.mean((self.measured - self.simulated) ** 2)))
        return Validation(self.recording_id, self.quantity, rmse, fit_percent(self.measured, self.simulated))


STARTS = 5
"""Gauss and Newton's steps for the start of a trial: its position enters as it is, its velocity nearly so."""


def replay(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str] | None = None, *, fit_start: bool = True
) -> tuple[Replay, ...]:
    """Simulate each trial; the model sees the commands and how the trial began, nothing else.

    `fit_start`: position and velocity at the start are those that suit the whole trial best; else a speed trial
    starts from its first measurement and a position trial from the straight line through its first five, noise and
    all. `buoyancy`: recording id -> parameter.
    """
    starts = np.array([_start(one) for one in trials]).reshape(-1, 2)
    for _ in range(STARTS if fit_start else 0):
        step = 0.01 * np.abs(starts[:, 1]) + 1e-3 * np.array([_rate(one) for one in trials])
        both = _responses(trials, estimate, buoyancy or {}, np.array([starts, starts + step[:, None] * [0.0, 1.0]]))
        for i, (one, (now, faster)) in enumerate(zip(trials, both, strict=True)):
            slope = (faster - now)[:, None] / step[i]
            H = np.hstack([np.ones(slope.shape), slope]) if one.quantity == "position" else slope
            gain, *_ = np.linalg.lstsq(H, one.response - now, rcond=None)
            starts[i, -gain.size :] += gain
    found = _responses(trials, estimate, buoyancy or {}, starts[None])
    return tuple(
        Replay(one.recording_id, one.quantity, one.time, one.response, y[0])
        for one, y in zip(trials, found, strict=True)
    )


def _rate(one: Trial) -> float:
    """Size of the velocities of a trial, above 0."""
    size = float(np.ptp(one.response))
    return max(size if one.quantity == "speed" else size / float(np.ptp(one.time)), 1e-6)


def _responses(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str], starts: Floats
) -> list[Floats]:
    """What would have been measured (k, n) in each of t trials, for k sets of starts (k, t, 2)."""
    states = [(f"x0[{i}]", f"v0[{i}]") for i in range(len(trials))]
    names = (*estimate.names, *(name for state in states for name in state))
    theta = np.hstack([np.tile(estimate.mean, (len(starts), 1)), starts.reshape(len(starts), -1)])
    floats = [buoyancy.get(one.recording_id, "") for one in trials]
    moved = simulate_all(trials, names, theta, floats, states)
    return [m.position if one.quantity == "position" else m.velocity for one, m in zip(trials, moved, strict=True)]


def validate(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str] | None = None, *, fit_start: bool = True
) -> tuple[Validation, ...]:
    """`replay` in numbers."""
    return tuple(found.validation for found in replay(trials, estimate, buoyancy, fit_start=fit_start))


def _start(one: Trial) -> Floats:
    """Position and velocity at the start of a trial as its first measurements have them."""
    if one.quantity == "speed":
        return np.array([0.0, one.response[0]])
    slope, level = np.polyfit(one.time[:5] - one.time[0], one.response[:5], 1)
    return np.array([level, slope])
