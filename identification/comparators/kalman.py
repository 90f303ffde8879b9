"""The vehicle's parameters as states that never change: extended Kalman filter, Rauch-Tung-Striebel smoother.

State: position, velocity over ground, then m and everything known from step one. Each trial starts with the
parameters as the one before left them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.maximum_likelihood import NOTHING, Gaussian
from identification.recording import Floats
from identification.thruster.thrust_data import Unusable
from identification.vehicle.inertia import InertiaFit, start_inertia, starts_of
from identification.vehicle.inertia_by_derivative import sensor_noise
from identification.vehicle.replay import validate
from identification.vehicle.simulation import column, current_along, integrate
from identification.vehicle.trials import Trial

START_SPREAD = 0.5
"""Relative standard deviation of the inertia before any measurement."""
SUBSTEPS = 2
"""Runge-Kutta steps between two measurements."""


@dataclass(frozen=True, eq=False)
class Smoothing:
    """One trial filtered, then smoothed. n measurements, states (position, velocity, parameters) of size s."""

    state: Floats
    """(n, s) smoothed."""
    cov: Floats
    """(n, s, s)"""
    innovation: Floats
    """(n,) measurement less prediction, in standard deviations: white with variance 1 when the model is right."""


@dataclass(frozen=True, eq=False)
class _Interval:
    """Mean signals between neighbouring measurements (T, n - 1) and their lengths (n - 1,)."""

    signal: Floats
    length: Floats


def _intervals(one: Trial) -> _Interval:
    edges = one.start + one.step * np.arange(one.force.signal.shape[1] + 1)
    zero = np.zeros((one.force.signal.shape[0], 1))
    total = np.hstack([zero, np.cumsum(one.force.signal * one.step, axis=1)])
    at = np.array([np.interp(one.time, edges, row) for row in total]).reshape(-1, one.time.size)
    length = np.diff(one.time)
    return _Interval(np.diff(at, axis=1) / np.maximum(length, 1e-9), length)


def _moved(one: Trial, names: Sequence[str], floats: str, states: Floats, signal: Floats, length: float) -> Floats:
    """States (k, s) after one interval."""
    theta = states[:, 2:]
    push = one.force.weights(names, theta) @ signal + column(names, theta, floats, 0.0)
    drift = current_along(names, theta, one.axis, one.heading)
    k, k2, m = (column(names, theta, name, value) for name, value in (("k", 0.0), ("k2", 0.0), ("m", 1.0)))
    steps = np.repeat(push[:, None], SUBSTEPS, axis=1)
    xi, x = integrate(steps, length / SUBSTEPS, states[:, 1] - drift, k, k2, m, drift)
    out = states.copy()
    out[:, 0] = states[:, 0] + x[:, -1]
    out[:, 1] = xi[:, -1] + drift
    return out


def smooth(one: Trial, start: Gaussian, names: Sequence[str], sigma: float, buoyancy: str = "") -> Smoothing:
    """Filter and smooth one trial from `start`, whose names are `x`, `v` and then `names`; `sigma` of a measurement."""
    n, s = one.time.size, start.mean.size
    between = _intervals(one)
    seen = 0 if one.quantity == "position" else 1
    mean, cov = start.mean.copy(), start.cov.copy()
    filtered, covs = np.empty((n, s)), np.empty((n, s, s))
    predicted, ahead, slopes = np.empty((n, s)), np.empty((n, s, s)), np.empty((n, s, s))
    innovation = np.empty(n)
    for i in range(n):
        if i:
            F = np.eye(s)
            step = 1e-4 * np.sqrt(np.diag(cov)) + 1e-9
            sets = np.vstack([mean, mean + np.diag(step), mean - np.diag(step)])
            moved = _moved(one, names, buoyancy, sets, between.signal[:, i - 1], float(between.length[i - 1]))
            F = ((moved[1 : s + 1] - moved[s + 1 :]) / (2 * step[:, None])).T
            mean, cov = moved[0], F @ cov @ F.T
            slopes[i] = F
        predicted[i], ahead[i] = mean, cov
        power = cov[seen, seen] + sigma**2
        gain = cov[:, seen] / power
        left = one.response[i] - mean[seen]
        innovation[i] = left / np.sqrt(power)
        mean = mean + gain * left
        keep = np.eye(s)
        keep[:, seen] -= gain
        cov = keep @ cov @ keep.T + sigma**2 * np.outer(gain, gain)  # Joseph's form stays positive
        filtered[i], covs[i] = mean, cov
    state, spread = filtered.copy(), covs.copy()
    for i in range(n - 2, -1, -1):
        back = np.linalg.lstsq(ahead[i + 1], slopes[i + 1] @ covs[i], rcond=None)[0].T
        state[i] = filtered[i] + back @ (state[i + 1] - predicted[i + 1])
        spread[i] = covs[i] + back @ (spread[i + 1] - ahead[i + 1]) @ back.T
    return Smoothing(state, spread, innovation)


def by_kalman(
    trials: Sequence[Trial], known: Gaussian = NOTHING, buoyancy: Mapping[str, str] | None = None
) -> InertiaFit | Unusable:
    """Inertia by an extended Kalman filter run over the trials in order."""
    if not trials:
        return Unusable("no trial was given; expected at least one with a measured motion")
    floats = dict(buoyancy or {})
    names = ("m", *known.names)
    m = start_inertia(trials, known, floats)
    p = len(names)
    mean, cov = np.append(m, known.mean), np.zeros((p, p))
    cov[0, 0], cov[1:, 1:] = (START_SPREAD * m) ** 2, known.cov
    starts, noise = starts_of(trials), tuple(sensor_noise(one) for one in trials)
    for i, (one, sigma) in enumerate(zip(trials, noise, strict=True)):
        v0, reach = starts[f"v0[{i}]"], float(np.ptp(one.response))
        rate = reach if one.quantity == "speed" else reach / float(np.ptp(one.time))
        whole = np.zeros((p + 2, p + 2))
        whole[0, 0] = (reach + sigma) ** 2 if one.quantity == "position" else 1e-12
        whole[1, 1] = (5 * rate + sigma) ** 2
        whole[2:, 2:] = cov
        x0 = starts.get(f"x0[{i}]", 0.0)
        begin = Gaussian(("x", "v", *names), np.concatenate([[x0, v0], mean]), whole)
        found = smooth(one, begin, names, sigma, floats.get(one.recording_id, ""))
        mean, cov = found.state[-1, 2:], found.cov[-1, 2:, 2:]
    estimate = Gaussian(names, mean, cov)
    return InertiaFit(trials[0].axis, "extended Kalman filter", estimate, noise, validate(trials, estimate, floats))
