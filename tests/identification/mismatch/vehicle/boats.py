"""A boat of one thruster, integrated by scipy, whose speed is logged; what is known of it; and models fitted to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from scipy.integrate import solve_ivp

from identification.mismatch.noise.covariance import Noise
from identification.mismatch.vehicle.fitting import Fit, fit, weights
from identification.mismatch.vehicle.model import VehicleModel, begin, layout_of
from identification.mismatch.vehicle.runs import Prepared, prepare
from identification.mismatch.vehicle.search import State
from identification.mismatch.vehicle.setup import ANY_AXIS, Stated, VehicleSetup
from identification.physics.vehicle.term import VehicleTerm
from identification.recording import Channel, Floats, Recording
from identification.vehicle.efficiency import Installation, Thruster

MASS, C, DRAG = 100.0, 0.4, 40.0
"""kg, N/V^2, N/(m/s)^2."""
KNOWN = Stated(MASS)
NOISE = 0.01
"""m/s, of one sample of the log, white."""
HOLD, LEVELS = 8.0, (3.0, 8.0, 12.0, -8.0, -12.0, 8.0, -3.0, 10.0)
"""s, V."""

Force = Callable[[float, float, float], float]
"""N of (time in s, command in V, speed in m/s)."""

NO_TERMS: Mapping[VehicleTerm, tuple[float, ...]] = MappingProxyType({})


def thrust(_t: float, volts: float, _v: float) -> float:
    return C * volts * abs(volts)


def speed_at(
    time: Floats, levels: Sequence[float], push: Force = thrust, v0: float = 0.0, drag: float = DRAG
) -> Floats:
    """(n,) m/s of m v' = push - k2 |v| v, hold by hold."""
    out, v = np.empty(time.size), v0
    for i, level in enumerate(levels):
        inside = (time >= i * HOLD) & (time < (i + 1) * HOLD)

        def slope(t: float, y: Floats, level: float = level) -> Floats:
            return (push(t, level, float(y[0])) - drag * np.abs(y) * y) / MASS

        done = solve_ivp(slope, (i * HOLD, (i + 1) * HOLD), [v], rtol=1e-8, atol=1e-10, dense_output=True)
        out[inside], v = done.sol(time[inside])[0], float(done.y[0, -1])
    return out


def boat(
    seed: int = 0, push: Force = thrust, levels: Sequence[float] = LEVELS, noise: float = NOISE, v0: float = 0.0
) -> Recording:
    """Holds of 8 s, ten samples a second."""
    time = np.arange(0.0, HOLD * len(levels), 0.1)
    value = speed_at(time, levels, push, v0) + noise * np.random.default_rng([seed, 7]).standard_normal(time.size)
    volts = np.array(levels)[(time / HOLD + 1e-9).astype(int)]
    channels = (
        Channel("command", "command", "command_voltage", "V", time, volts, thruster="T1", axis="surge"),
        Channel("speed", "log", "speed", "m/s", time, value, axis="surge"),
    )
    return Recording(f"boat-{seed}", "boat", channels, kind="vehicle")


def orders(number: int) -> list[tuple[float, ...]]:
    """The same levels in other orders."""
    return [tuple(np.random.default_rng([3, i]).permutation(LEVELS).tolist()) for i in range(number)]


def prepared(runs: Sequence[Recording], mass: Stated | None = KNOWN, std: float = 0.0) -> Prepared:
    """What is known: the mass, and C with a standard error of `std`."""
    installation = Installation((Thruster("T1", np.array([C]), {"surge": 1.0}),), np.array([[std**2]]))
    setup = VehicleSetup(installation, {} if mass is None else {ANY_AXIS: mass}, current=False)
    found = prepare(runs, installation, "surge", setup)
    assert isinstance(found, Prepared), found
    return found


def fitted(data: Prepared, terms: Mapping[VehicleTerm, tuple[float, ...]] = NO_TERMS, noise: float = NOISE) -> Fit:
    """The model of these terms, begun at these values, beside the white noise that was put in."""
    layout = layout_of(VehicleModel(tuple(terms)), data)
    theta = begin(layout, data)
    for term, values in terms.items():
        theta[layout.of(term)] = values
    return fit(layout, theta, data, weights(Noise(noise**2, 0.0), data))


def state(data: Prepared, terms: Mapping[VehicleTerm, tuple[float, ...]] = NO_TERMS, noise: float = NOISE) -> State:
    """The same with its noise, as a search hands it on."""
    law = Noise(noise**2, 0.0)
    return State(fitted(data, terms, noise), law, weights(law, data))


def banded(half_width: float) -> Force:
    """N of a thruster with a dead band of so many V."""
    return lambda t, volts, v: thrust(t, float(np.sign(volts)) * max(abs(volts) - half_width, 0.0), v)


def weak_at_8(t: float, volts: float, v: float) -> float:
    """8 V ahead gives 20 N less than C V|V|: no effect has it."""
    return thrust(t, volts, v) - (20.0 if volts == 8.0 else 0.0)


def part(data: Prepared, *runs: int) -> Prepared:
    return replace(data, runs=tuple(data.runs[j] for j in runs))
