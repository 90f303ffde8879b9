"""Inertia the thesis's way (section 4.2.3): Savitzky and Golay's derivatives of the position, then a straight line.

Noise of the velocity enters the drag and so the net force; a plain straight line through noisy forces is too flat, the
inertia too large (9 % in a trial of the simulated vehicle). The slope is therefore taken along an instrument: the net
force of a simulated vehicle, which has no noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.recording import Floats
from identification.vehicle.simulation import column, current_along, simulate
from identification.vehicle.trials import Trial
from identification.velocity.velocity import Window, derivative

SMOOTHING = Window(10, 10)
"""The thesis's n_l = n_r = 10 (section 4.2.3)."""
ORDER = 4
"""Its order."""
INSTRUMENTS = 3
"""Simulations, each with the inertia found with the one before."""
LEAST = 4 * SMOOTHING.size // 2 + 2 * ORDER
"""Measurements of a trial below which nothing is left between the ends of two filters."""


def sensor_noise(one: Trial) -> float:
    """Noise of one measurement as its own neighbours tell it, whatever the vehicle does."""
    found = derivative(one.time, one.response, SMOOTHING, ORDER, "leave out").position_noise
    return max(found, 1e-9 * float(np.ptp(one.response)), 1e-12)


def running_integral(y: Floats, time: Floats) -> Floats:
    """Trapezium rule from the first time on, (n,).

    >>> running_integral(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 2.0])).tolist()
    [0.0, 0.5, 2.0]
    """
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(time))])


def _inner(y: Floats) -> Floats:
    """Without the ends that have no whole window."""
    return y[SMOOTHING.n_l : -SMOOTHING.n_r]


def _derivative(time: Floats, y: Floats) -> Floats:
    return _inner(derivative(time, y, SMOOTHING, ORDER, "leave out").velocity)


def _acceleration(one: Trial, signal: Floats) -> Floats:
    """Savitzky and Golay's derivative, twice for a position; the ends of the filters are left out."""
    first = _derivative(one.time, signal)
    return first if one.quantity == "speed" else _derivative(_inner(one.time), first)


def _as_measured(one: Trial, force: Floats) -> Floats:
    """A force (n,) integrated to what a mass of 1 kg would have been measured to do, and filtered like it."""
    moved = running_integral(force, one.time)
    return _acceleration(one, running_integral(moved, one.time) if one.quantity == "position" else moved)


@dataclass(frozen=True, eq=False)
class Smoothed:
    """What the filters make of a trial, whatever the vehicle's parameters."""

    trial: Trial
    velocity: Floats
    """(n,) over ground."""
    acceleration: Floats
    """Without the ends."""
    noise_std: float
    heard: tuple[Floats, Floats]
    """What one noisy measurement does to the acceleration, and to the drag force per unit of its slope."""


def smoothed(one: Trial) -> Smoothed | None:
    """None when the trial is too short."""
    if one.time.size < LEAST:
        return None
    found = derivative(one.time, one.response, SMOOTHING, ORDER)
    v = found.velocity if one.quantity == "position" else found.position
    impulse = np.zeros(one.time.size)
    impulse[one.time.size // 2] = 1.0
    heard = _acceleration(one, impulse), _acceleration(one, running_integral(impulse, one.time))
    return Smoothed(one, v, _acceleration(one, one.response), sensor_noise(one), heard)


def inverse_inertia(
    found: Smoothed, names: Sequence[str], theta: Floats, buoyancy: Mapping[str, str]
) -> tuple[float, float]:
    """1/m and its standard deviation from one trial, drag and efficiencies theta (p,) given; NaN if it is none.

    Acceleration and force go through the same filters, so that what is flattened in one is flattened in the other.
    The noise of the measurement is taken as white and followed through the filters.
    """
    one, y, sets = found.trial, found.acceleration, theta[None]
    drift = current_along(names, sets, one.axis, one.heading)[0]
    middle = one.start + (np.arange(one.force.signal.shape[1]) + 0.5) * one.step
    push = np.interp(one.time, middle, (one.force.weights(names, sets) @ one.force.signal)[0])
    push = push + column(names, sets, buoyancy.get(one.recording_id, ""), 0.0)[0]
    k, k2 = column(names, sets, "k", 0.0)[0], column(names, sets, "k2", 0.0)[0]

    def net(v: Floats) -> Floats:
        xi = v - drift
        out: Floats = push - k * xi - k2 * np.abs(xi) * xi
        return out

    h = _as_measured(one, net(found.velocity))
    z, q = h, float("nan")
    for _ in range(INSTRUMENTS):
        if not float(z @ h) > 0:
            return float("nan"), float("nan")
        q = float(z @ y) / float(z @ h)
        if not q > 0:
            return float("nan"), float("nan")
        start = np.append(theta, [1 / q, found.velocity[0]])[None]
        moved = simulate(one, (*names, "m", "v0"), start, buoyancy.get(one.recording_id, ""))
        z = _as_measured(one, net(moved.velocity[0]))
    slope = float(np.mean(k + 2 * k2 * np.abs(found.velocity - drift)))
    weight = z / float(z @ h)
    heard = found.heard[0] + q * slope * found.heard[1]
    return q, found.noise_std * float(np.linalg.norm(np.convolve(weight, heard)))
