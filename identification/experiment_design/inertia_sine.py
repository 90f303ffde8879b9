"""Amplitude and frequency of the sine force that tell the inertia best (section 4.2.1: the second step).

    m v' = -k v - k_q |v| v + f0 + a sin(omega t),  x' = v,  position x measured with white noise

The variance of m is its Cramér-Rao bound from the position samples: the sensitivities of x to m, k, k_q and to the
start (x0, v0) are integrated along with the motion, for all candidates at once, by Runge and Kutta's fourth order.
What is known of the drag from the runs at constant speed enters as prior information. A fast sine hardly moves the
vehicle, a slow one takes it far: the travel that the water allows decides the frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.experiment_design.experiment import Impossible
from identification.recording import Floats

AMPLITUDES, FREQUENCIES, ROUNDS = 12, 24, 4
"""Candidates of one round, and how often the grid is drawn in around the best one."""
STEPS_PER_RADIAN = 5
"""Least integration steps in the shortest time constant of drag, or in a radian of the fastest sine (error 1e-4)."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """What is known beforehand; SI, for yaw read kg m^2, N m s/rad and so on."""

    m: float
    """kg, expected inertia with added mass."""
    k: float
    """N s/m, linear drag."""
    k_q: float
    """N s^2/m^2, quadratic drag."""
    k_std: float = 0.0
    k_q_std: float = 0.0
    """Standard deviations from the drag runs; 0: taken as known, inf: unknown."""
    f0: float = 0.0
    """N, constant force during the test (buoyancy, say)."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Of the test."""

    duration: float
    """s"""
    rate: float
    """Hz, position samples."""
    sigma: float
    """m, standard deviation of the position noise."""
    max_force: float
    """N, of |f0 + a sin|, or of its square law."""
    max_travel: float = float("inf")
    """m, highest less lowest position."""
    max_speed: float = float("inf")
    """m/s"""
    omega: tuple[float, float] = (0.02, 5.0)
    """rad/s, lowest and highest frequency."""
    of_voltage: bool = False
    """The voltage is the sine, so the force is a |sin| sin (eq. 4.14): what a plan of kind `sine` commands."""


@dataclass(frozen=True, slots=True)
class SineTest:
    """The best sine."""

    amplitude: float
    """N"""
    omega: float
    """rad/s"""
    m_std: float
    """kg, Cramér-Rao bound."""
    travel: float
    """m"""
    speed: float
    """m/s, highest."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """Of c candidates, each (c,)."""

    m_std: Floats
    travel: Floats
    speed: Floats


def predict(amplitude: Floats, omega: Floats, vehicle: Vehicle, limits: Limits) -> Predicted:
    """Bound on the standard deviation of m, travel and speed for sines (c,) from rest at x = 0; x0 and v0 unknown."""
    drag = vehicle.k + 2 * np.sqrt(vehicle.k_q * limits.max_force)
    fastest = max(drag / vehicle.m, float(omega.max()))
    inside = max(1, int(np.ceil(STEPS_PER_RADIAN * fastest / limits.rate)))
    h, samples = 1 / (limits.rate * inside), int(limits.duration * limits.rate)
    state = np.zeros((10, amplitude.size))
    state[6] = 1.0
    far, low, high = np.zeros((3, amplitude.size))
    M = np.zeros((amplitude.size, 5, 5))
    for i in range(samples * inside + 1):
        if i % inside == 0:
            row = np.stack([state[2], state[3], state[4], np.ones(amplitude.size), state[5]], axis=1)
            M += row[:, :, None] * row[:, None, :] / limits.sigma**2
        np.maximum(far, np.abs(state[1]), out=far)
        np.minimum(low, state[0], out=low)
        np.maximum(high, state[0], out=high)
        force = [_force(i * h + part * h, amplitude, omega, vehicle.f0, limits.of_voltage) for part in (0, 0.5, 1)]
        state = _step(state, h, force, vehicle)
    return Predicted(_m_std(M, vehicle), high - low, far)


def _force(t: float, amplitude: Floats, omega: Floats, f0: float, of_voltage: bool) -> Floats:
    wave = np.sin(omega * t)
    out: Floats = f0 + amplitude * (wave * np.abs(wave) if of_voltage else wave)
    return out


def _rates(s: Floats, force: Floats, vehicle: Vehicle) -> Floats:
    """State (10, c): x, v, dx/d(m, k, k_q, v0), dv/d(v0, m, k, k_q)."""
    v, out = s[1], np.empty_like(s)
    pull = force - vehicle.k * v - vehicle.k_q * np.abs(v) * v
    slope = -(vehicle.k + 2 * vehicle.k_q * np.abs(v)) / vehicle.m
    out[0], out[1] = v, pull / vehicle.m
    out[2:5], out[5] = s[7:10], s[6]
    out[6:] = slope * s[6:]
    out[7] -= pull / vehicle.m**2
    out[8] -= v / vehicle.m
    out[9] -= np.abs(v) * v / vehicle.m
    return out


def _step(s: Floats, h: float, force: list[Floats], vehicle: Vehicle) -> Floats:
    """One step of h s; `force` at its start, middle and end."""
    a = _rates(s, force[0], vehicle)
    b = _rates(s + h / 2 * a, force[1], vehicle)
    c = _rates(s + h / 2 * b, force[1], vehicle)
    d = _rates(s + h * c, force[2], vehicle)
    out: Floats = s + h / 6 * (a + 2 * b + 2 * c + d)
    return out


def _m_std(M: Floats, vehicle: Vehicle) -> Floats:
    """Of the first parameter, with drag known as well as its standard deviations say; inf when it is not seen."""
    stds = (float("inf"), vehicle.k_std, vehicle.k_q_std, float("inf"), float("inf"))
    free = [i for i, std in enumerate(stds) if std > 0]
    with_prior = M + np.diag([1 / std**2 if std > 0 else 0.0 for std in stds])
    some = with_prior[:, free][:, :, free]
    size = np.sqrt(np.diagonal(some, axis1=1, axis2=2))
    size = np.where(size > 0, size, 1.0)
    scaled = some / (size[:, :, None] * size[:, None, :])
    seen = np.linalg.eigvalsh(scaled)[:, 0] > 1e-13
    scaled[~seen] = np.eye(len(free))
    out: Floats = np.where(seen, np.sqrt(np.linalg.inv(scaled)[:, 0, 0]) / size[:, 0], np.inf)
    return out


def best_sine(vehicle: Vehicle, limits: Limits) -> SineTest | Impossible:
    """Grid over amplitude and frequency, drawn in around the best candidate that keeps to the limits.

    Raises ValueError for a test too short or limits that are not above zero.

    >>> limits = Limits(180.0, 3.0, 0.07, max_force=60.0, max_travel=8.0)
    >>> found = best_sine(Vehicle(500.0, 170.0, 0.0), limits)
    >>> isinstance(found, SineTest) and 59 < found.amplitude <= 60 and 7.5 < found.travel <= 8.0
    True
    """
    if limits.duration * limits.rate < 5 or min(limits.sigma, limits.max_force, limits.omega[0], vehicle.m) <= 0:
        raise ValueError(f"best_sine: needs 5 samples and sigma, max_force, omega and m above 0, got {limits}")
    most = limits.max_force - abs(vehicle.f0)
    if most <= 0:
        return Impossible(f"the constant force of {vehicle.f0:g} N leaves nothing of {limits.max_force:g} N for a sine")
    amplitudes, (slow, fast) = (most / 200, most), limits.omega
    best: SineTest | None = None
    for _ in range(ROUNDS):
        a = np.geomspace(*amplitudes, AMPLITUDES)
        w = np.geomspace(slow, fast, FREQUENCIES)
        best = _best_of(np.repeat(a, w.size), np.tile(w, a.size), vehicle, limits, best)
        if best is None:
            break
        ratio, factor = (a[1] / a[0]) ** 1.5, (w[1] / w[0]) ** 1.5
        amplitudes = (best.amplitude / ratio, min(most, best.amplitude * ratio))
        slow, fast = max(limits.omega[0], best.omega / factor), min(limits.omega[1], best.omega * factor)
    return best or Impossible("no sine within the limits of force, travel and speed tells the inertia")


def _best_of(a: Floats, w: Floats, vehicle: Vehicle, limits: Limits, best: SineTest | None) -> SineTest | None:
    found = predict(a, w, vehicle, limits)
    allowed = (found.travel <= limits.max_travel) & (found.speed <= limits.max_speed)
    score = np.where(allowed, found.m_std, np.inf)
    i = int(np.argmin(score))
    if not np.isfinite(score[i]) or (best is not None and best.m_std <= score[i]):
        return best
    return SineTest(float(a[i]), float(w[i]), float(score[i]), float(found.travel[i]), float(found.speed[i]))
