"""The uncoupled vehicle m xi' = -k xi - k2 |xi| xi + tau (eq. 4.13) simulated for many parameter sets at once.

xi is the velocity through the water; a uniform current adds to the velocity over ground. Buoyancy (heave) is a
constant force. Runge and Kutta's fourth-order rule; in each step the force is a straight line with the mean that the
trial gives and the slope of its neighbours (a constant one puts the vehicle off by (change of force / m) h^2/12).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.maximum_likelihood import Gaussian, maximise
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
    push: Floats, step: float, xi0: Floats, k: Floats, k2: Floats, m: Floats, drift: Floats
) -> tuple[Floats, Floats]:
    """Velocity through the water and distance over ground (k, g + 1) at the ends of g steps; `push` (k, g) N.

    >>> one = np.ones(1)
    >>> xi, x = integrate(np.full((1, 100), 8.0), 0.1, 0 * one, 2 * one, 0 * one, 4 * one, 0 * one)
    >>> bool(abs(xi[0, -1] - 4 * (1 - np.exp(-5.0))) < 1e-6), bool(abs(x[0, -1] - (40 - 2 * xi[0, -1])) < 1e-6)
    (True, True)
    """
    count, steps = push.shape
    half = 0.5 * np.gradient(push, axis=1) if steps > 1 else np.zeros(push.shape)
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
    weights = trial.force.weights(names, theta)
    push = weights @ trial.force.signal + column(names, theta, buoyancy, 0.0)[:, None]
    drift = current_along(names, theta, trial.axis, trial.heading)
    k, k2, m = (column(names, theta, name, value) for name, value in (("k", 0.0), ("k2", 0.0), ("m", 1.0)))
    v0 = column(names, theta, state[1], 0.0)
    xi, x = integrate(push, trial.step, v0 - drift, k, k2, m, drift)
    x = x + column(names, theta, state[0], 0.0)[:, None]
    return Motion(*_at_measurements(trial, xi + drift[:, None], x))


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


def replay(one: Trial, estimate: Gaussian, buoyancy: str = "", *, fit_start: bool = True) -> Replay:
    """Simulate a trial; the model sees the commands and how the trial began, nothing else.

    `fit_start`: position and velocity at the start are those that suit the whole trial best; else a speed trial
    starts from its first measurement and a position trial from the straight line through its first five, noise and
    all. `buoyancy`: the parameter of this trial's ballast.
    """
    names = (*estimate.names, "x0", "v0")
    start = _start(one)

    def response(starts: Floats) -> Floats:
        theta = np.column_stack([np.tile(estimate.mean, (len(starts), 1)), starts])
        moved = simulate(one, names, theta, buoyancy)
        return moved.position if one.quantity == "position" else moved.velocity

    if fit_start:
        size = np.maximum(np.abs(start), 0.01 * max(float(np.ptp(one.response)), 1e-6))
        start = maximise(("x0", "v0"), start, size, lambda starts: one.response - response(starts)).estimate.mean
    return Replay(one.recording_id, one.quantity, one.time, one.response, response(start[None])[0])


def validate(
    trials: Sequence[Trial], estimate: Gaussian, buoyancy: Mapping[str, str] | None = None, *, fit_start: bool = True
) -> tuple[Validation, ...]:
    """`replay` of each trial in numbers. `buoyancy`: recording id -> parameter."""
    floats = buoyancy or {}
    return tuple(
        replay(one, estimate, floats.get(one.recording_id, ""), fit_start=fit_start).validation for one in trials
    )


def _start(one: Trial) -> Floats:
    """Position and velocity at the start of a trial as its first measurements have them."""
    if one.quantity == "speed":
        return np.array([0.0, one.response[0]])
    slope, level = np.polyfit(one.time[:5] - one.time[0], one.response[:5], 1)
    return np.array([level, slope])
