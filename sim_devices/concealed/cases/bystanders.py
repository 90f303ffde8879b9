"""What is recorded and changes nothing: a thruster beside it that takes no thrust, water that warms without effect.

Without them a recorded neighbour would be a sure sign of `thruster_interaction`, a thermometer in the water one of
`temperature_squared`. They are drawn by a generator of their own, so whatever else is drawn stays the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sim_devices.concealed.cases.definition import Case, Sensor
from sim_devices.world.noise_law import NoiseLaw

Rng = np.random.Generator

WITH_NEIGHBOUR = 0.2
WITH_THERMOMETER = 0.25
WARMING = 0.5
"""Share of the thermometers that see the water change its temperature."""
NEIGHBOURED = frozenset({"thruster_interaction"})
WARMED = frozenset({"temperature_squared"})
HEATED = frozenset({"heating", "thermal_derating"})
"""Follow the motor's rise over its water, of which its thermometer tells only the sum: their water stays as it is."""


def with_bystanders(case: Case, rng: Rng, named: frozenset[str]) -> Case:
    """`case` with a neighbour and a thermometer in the water, each at random, where `named` effects bring none."""
    if not named & NEIGHBOURED and rng.random() < WITH_NEIGHBOUR:
        case = replace(case, decoys={**case.decoys, "thruster_interaction": _neighbour(case, rng)})
    if not named & WARMED and rng.random() < WITH_THERMOMETER:
        case = replace(case, sensors=(*case.sensors, thermometer(case.dt, rng)))
        if not named & HEATED and rng.random() < WARMING:
            case = replace(case, temperature_drift=warming(rng) / case.scale.duration)
    return case


def warming(rng: Rng) -> float:
    """K in the course of a case."""
    return float(rng.uniform(4.0, 8.0)) * float(rng.choice((-1.0, 1.0)))


def thermometer(dt: float, rng: Rng) -> Sensor:
    """In the water, on a grid of `dt` s."""
    low, high = np.log((0.5, 2.0))
    every = max(round(1.0 / (dt * float(np.exp(rng.uniform(low, high))))), 1)
    std = float(np.exp(rng.uniform(*np.log((0.005, 0.05)))))
    return Sensor("water_temperature", "degC", every, int(rng.integers(every)), NoiseLaw(std))


def _neighbour(case: Case, rng: Rng) -> dict[str, float]:
    """It runs on and off, and takes nothing."""
    period = case.scale.duration / float(rng.uniform(4.0, 9.0))
    thrust = case.scale.thrust
    return {
        "loss": 0.0,
        "neighbour_thrust": thrust,
        "period": period,
        "on_time": 0.5 * period,
    }
