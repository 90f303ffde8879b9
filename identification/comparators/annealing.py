"""The vehicle found by simulated annealing on the error of the simulated position: no derivative, no start needed.

It says in which valley the error is least, not how well that is known: from there `vehicle.inertia.output_error`
goes to the bottom, with the starts of the trials and all that was known beforehand free to move, and the covariance is
that of its estimate. (The annealed values themselves had some 20 times the variance in ten runs: they are found with
the velocity at the start held at what the first, noisy, measurements show.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import dual_annealing

from identification.estimation.maximum_likelihood import Gaussian
from identification.recording import Floats
from identification.thruster.thrust_data import Unusable
from identification.vehicle.inertia import InertiaFit, output_error, responses, starts_of
from identification.vehicle.replay import validate
from identification.vehicle.trials import Trial


def by_annealing(
    trials: Sequence[Trial],
    known: Gaussian,
    bounds: Mapping[str, tuple[float, float]],
    rng: np.random.Generator,
    buoyancy: Mapping[str, str] | None = None,
    rounds: int = 60,
) -> InertiaFit | Unusable:
    """Search the parameters of `bounds` (m at least; both positive: searched in log) with `known` held fixed.

    Trials start with the velocity that their first measurements show; the position at the start is where the error is
    least. `rounds` of the annealing, each some hundred simulations.
    """
    if not trials or not bounds:
        return Unusable("by_annealing: needs at least one trial and the bounds of one parameter")
    floats, starts = dict(buoyancy or {}), starts_of(trials)
    fixed = [name for name in known.names if name not in bounds]
    names = (*bounds, *fixed, *starts)
    rest = np.array([*(known[name] for name in fixed), *starts.values()])
    limits = np.log(np.array(list(bounds.values())))

    def cost(logs: Floats) -> float:
        theta = np.concatenate([np.exp(logs), rest])[None]
        return sum(_error(one, y[0]) for one, y in zip(trials, responses(trials, names, theta, floats), strict=True))

    found = dual_annealing(
        cost, list(map(tuple, limits)), maxiter=rounds, rng=rng, no_local_search=len(bounds) > 4, maxfun=40 * rounds
    )
    chosen = dict(zip(bounds, np.exp(found.x).tolist(), strict=True))
    local = output_error(trials, known, chosen, floats)
    assert not isinstance(local, Unusable)  # there are trials
    return replace(local, method="simulated annealing", validation=validate(trials, local.estimate, floats))


def _error(one: Trial, y: Floats) -> float:
    left = one.response - y
    if one.quantity == "position":
        left = left - left.mean()
    return float(left @ left)
