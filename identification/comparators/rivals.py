"""The inertia by other ways that the thesis names, of the same trials and with the same knowledge of drag."""

from __future__ import annotations

import numpy as np

from identification.comparators import by_annealing, by_kalman
from identification.estimation.maximum_likelihood import independent
from identification.thruster.thrust_data import Unusable
from identification.vehicle.campaign import AxisResult
from identification.vehicle.inertia import InertiaFit, by_derivative

REACH = 4.0
"""The annealing searches from m / REACH to m x REACH of the inertia found by output error."""
ROUNDS = 12
"""Of the annealing: one parameter within a factor of four is found in a few hundred simulations."""
SEED = 1
"""Of the annealing: the same recordings give the same answer."""


def rivals(result: AxisResult) -> tuple[InertiaFit | Unusable, ...]:
    """Savitzky and Golay's derivative, Kalman smoother, simulated annealing."""
    if isinstance(result.inertia, Unusable) or isinstance(result.drag, Unusable):
        why = f"{result.axis}: the other ways to the inertia need drag from constant-velocity runs and an inertia trial"
        return (Unusable(why),)
    last = result.inertia.estimate
    fresh = [name for name in last.names if name.startswith("buoyancy") and name not in result.known.names]
    stated = result.known.select([name for name in result.known.names if name != "m"])
    known = independent(stated, last.select(fresh))
    m = abs(last["m"])
    search = {"m": (m / REACH, m * REACH)}
    return (
        by_derivative(result.moving, known, result.ballast),
        by_kalman(result.moving, known, result.ballast),
        by_annealing(result.moving, known, search, np.random.default_rng(SEED), result.ballast, ROUNDS),
    )
