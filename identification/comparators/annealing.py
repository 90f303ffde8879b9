"""The vehicle found by simulated annealing on the error of the simulated position: no derivative, no start needed.

It says where the error is least, not how well that is known: the covariance is that of the likelihood's curvature
there, by `identification.inertia.output_error` started from it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import dual_annealing

from identification.inertia import InertiaFit, output_error, responses, starts_of
from identification.maximum_likelihood import Gaussian
from identification.recording import Floats
from identification.thrust_data import Unusable
from identification.vehicle_simulation import validate
from identification.vehicle_trials import Trial


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
    if isinstance(local, Unusable):
        return local
    mean = local.estimate.mean.copy()
    for name, value in {**chosen, **{n: known[n] for n in fixed}}.items():
        mean[local.estimate.names.index(name)] = value
    estimate = Gaussian(local.estimate.names, mean, local.estimate.cov)
    return replace(
        local, method="simulated annealing", estimate=estimate, validation=validate(trials, estimate, floats)
    )


def _error(one: Trial, y: Floats) -> float:
    left = one.response - y
    if one.quantity == "position":
        left = left - left.mean()
    return float(left @ left)
