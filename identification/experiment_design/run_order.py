"""In which order to hold the levels, so that what changes slowly does not look like a parameter.

A slow change d (n,) of the means, unknown to the model, moves the parameters by A d, A = (H'WH)^-1 H'W: it aliases. How
far, in units of what noise does to the coefficients, depends on the order alone. Two changes are thought of:

- drift of the cell and of the water, a random walk, which is a sum of half-cosines of k half-periods over the run with
  variances 2 / (pi k)^2 of the walk's own at its end (Karhunen and Loève); k = 1 is close to a straight line;
- heating: a first-order state driven by the copper loss, V^4, that lowers the thrust in proportion. The mean state
  cannot be told from C and is left out: C is the one of a motor as warm as it is on the mean.

Both, and the time that goes into ramps, have one currency: by how much they raise the variance of the coefficients. An
order is improved by exchanging two holds as long as the sum gets less.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.experiment_design.thrust_design import Means, Noise, Terms
from identification.recording import Floats

HALF_COSINES = 6
THERMAL_TIME = 60.0
"""s, time constant of a small motor's copper in water, if nothing better is known."""


@dataclass(frozen=True, slots=True)
class Course:
    """How a run goes beside its holds; see rig.campaign.plan.Plan. `slew` V/s, the others s."""

    slew: float
    zero_every: int
    rest: float
    tare: float
    settle: float


@dataclass(frozen=True, slots=True)
class Slow:
    """How much changes slowly."""

    drift: float
    """N, standard deviation of the change from the start of the run to its end."""
    heating: float = 0.02
    """Share of the thrust that is lost when the motor is as warm as after long at the highest voltage."""
    thermal_time: float = THERMAL_TIME


@dataclass(frozen=True, eq=False)
class Exposure:
    """Mean variance that a slow change adds to the coefficients, in units of the variance that noise gives them."""

    drift: float
    heating: float
    per_drift: Floats
    """(p,) change of each parameter for a straight drift of 1 N from the start of the run to its end."""


def schedule(levels: Floats, dwells: Floats, course: Course) -> tuple[Means, float]:
    """Means of a run that holds `levels` (k,) V for `dwells` (k,) s, tares as in a Plan, and its whole time in s.

    >>> run, total = schedule(np.array([10.0]), np.array([3.0]), Course(10.0, 0, 1.0, 2.0, 1.0))
    >>> run.voltage.tolist(), run.seconds.tolist(), run.at.tolist(), total
    ([0.0, 10.0, 0.0], [2.0, 2.0, 2.0], [1.0, 5.0, 9.0], 10.0)
    """
    k, every = levels.size, course.zero_every or levels.size
    returns = np.append(np.arange(every, k, every), k)
    V = np.insert(levels, returns, 0.0)
    holding = np.insert(dwells - course.settle, returns, course.tare)
    waiting = np.insert(np.full(k, course.settle), returns, course.rest)
    waiting += np.abs(np.diff(V, prepend=0.0)) / course.slew
    end = course.tare + np.cumsum(waiting + holding)
    means = Means(np.append(0.0, V), np.append(course.tare, holding), np.append(course.tare / 2, end - holding / 2))
    return means, float(end[-1])


def heat_state(means: Means, V_max: float, thermal_time: float) -> Floats:
    """(n,) temperature in the middle of each mean, 1 being that after long at V_max; cold at the start."""
    source = (means.voltage / V_max) ** 4
    gap = np.diff(means.at, prepend=0.0)
    kept = np.exp(-gap / thermal_time)
    state, last, out = 0.0, 0.0, []
    for heat, share in zip(source.tolist(), kept.tolist(), strict=True):
        state = share * state + (1 - share) * (heat + last) / 2
        last = heat
        out.append(state)
    return np.array(out)


def exposure(means: Means, terms: Terms, noise: Noise, slow: Slow, V_max: float, total: float) -> Exposure:
    """Of a run of `total` s that tells all parameters (see `thrust_design.promise`)."""
    thrust = terms.thrust(means.voltage)
    error = noise.std(thrust, means.seconds)
    H = terms.rows(means.voltage) / error[:, None]
    cov: Floats = np.asarray(np.linalg.inv(H.T @ H), dtype=np.float64)
    u = means.at / total
    k = np.arange(1, HALF_COSINES + 1)
    drift: Floats = slow.drift * np.sqrt(2) / (np.pi * k) * np.cos(np.pi * u[:, None] * k)
    state = heat_state(means, V_max, slow.thermal_time)
    power = (thrust / error) ** 2
    warm = slow.heating * thrust * (state - float(state @ power / power.sum()))
    line = cov @ H.T @ ((u - 0.5) / error)
    by_drift, by_heat = drift / error[:, None], warm / error
    return Exposure(_added(H, cov, by_drift), _added(H, cov, by_heat[:, None]), line)


def _added(H: Floats, cov: Floats, change: Floats) -> float:
    """Variance that whitened changes (n, c) together add to the coefficients, the tare not counted."""
    moved = (cov @ H.T @ change)[:-1]
    return float(np.sum(moved * np.linalg.solve(cov[:-1, :-1], moved))) / len(moved)


def spread_out(levels: Floats, counts: Floats, every: int) -> Floats:
    """Each level `counts` times, evenly over the run; between zero returns up, then down: the start of the search.

    >>> spread_out(np.array([-5.0, 5.0]), np.array([4, 4]), 4).tolist()
    [-5.0, -5.0, 5.0, 5.0, 5.0, 5.0, -5.0, -5.0]
    """
    places = [(np.arange(n) + (i + 1) / (levels.size + 1)) / n for i, n in enumerate(counts.astype(int))]
    even = np.repeat(levels, counts.astype(int))[np.argsort(np.concatenate(places), kind="stable")]
    parts = np.split(even, np.arange(every, even.size, every)) if every else [even]
    return np.concatenate([np.sort(part)[:: (-1) ** k] for k, part in enumerate(parts)])


@dataclass(frozen=True, eq=False)
class Setting:
    """All but the order."""

    course: Course
    terms: Terms
    noise: Noise
    V_max: float
    slow: Slow

    def loss(self, levels: Floats, dwells: Floats) -> float:
        """Relative variance that drift and heating add, and that the time in ramps costs."""
        means, total = schedule(levels, dwells, self.course)
        found = exposure(means, self.terms, self.noise, self.slow, self.V_max, total)
        ramps = np.abs(np.diff(means.voltage)).sum() / self.course.slew / total
        return found.drift + found.heating + float(ramps)


def best_order(
    levels: Floats, dwells: Floats, setting: Setting, tries: int, rng: np.random.Generator
) -> NDArray[np.intp]:
    """Indices (k,) of the holds in a good order, starting from the one given; `tries` exchanges are tried.

    >>> from numpy.random import default_rng
    >>> V = np.array([5.0, 5.0, 10.0, 10.0, -5.0, -5.0, -10.0, -10.0])
    >>> setting = Setting(Course(20.0, 4, 1.0, 2.0, 0.5), Terms(), Noise(0.1), 10.0, Slow(0.1))
    >>> order = best_order(V, np.full(8, 4.0), setting, 200, default_rng(1))
    >>> bool(setting.loss(V[order], np.full(8, 4.0)) < 0.8 * setting.loss(V, np.full(8, 4.0)))
    True
    """
    order = np.arange(levels.size, dtype=np.intp)
    best = setting.loss(levels, dwells)
    for _ in range(tries):
        i, j = rng.integers(0, levels.size, 2)
        if levels[order[i]] == levels[order[j]]:
            continue
        order[[i, j]] = order[[j, i]]
        loss = setting.loss(levels[order], dwells[order])
        if loss < best:
            best = loss
        else:
            order[[i, j]] = order[[j, i]]
    return order
