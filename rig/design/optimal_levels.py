"""Which levels, for how many seconds each: the continuous optimum over the time that a run leaves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from identification.experiment_design.experiment import Candidates, Criterion, Design, copper_heat, optimal_levels
from identification.experiment_design.run_order import Course, Setting, Slow, schedule
from identification.experiment_design.thrust_design import Noise, Terms
from identification.recording import Floats
from rig.errors import PlanError

GOOD = 2e-3
"""Loss of efficiency allowed to the continuous optimum: whole holds lose more."""
THOROUGH = 1500
"""Exchanges tried in search of the order of the chosen dwell length."""
DRIFT = 1e-3
"""Of the highest thrust: drift over a run that the order is made for, if nothing better is known."""


@dataclass(frozen=True, eq=False)
class Ask:
    """What is wanted, and within which limits."""

    terms: Terms
    noise: Noise
    candidates: Floats
    """(n,) V that may be held, ascending: a grid, or all there is if `only_these`."""
    total: float
    """s from the first tare to the last."""
    course: Course
    criterion: Criterion = "A"
    max_heat: float = float("inf")
    """Mean copper heat, 1 being that at the highest candidate."""
    max_dwell: float = 8.0
    """s, settling included."""
    least_mean: float = 0.5
    """s of measurement that a hold must give."""
    check_levels: int = 4
    slow: Slow | None = None
    """None: a drift of DRIFT times the highest thrust."""
    only_these: bool = False
    tries: int = THOROUGH
    seed: int = 0

    @property
    def V_max(self) -> float:
        return float(np.abs(self.candidates).max())

    @property
    def setting(self) -> Setting:
        return Setting(self.course, self.terms, self.noise, self.V_max, self.slow or self._usual)

    @property
    def _usual(self) -> Slow:
        return Slow(DRIFT * float(self.terms.thrust(np.array([self.V_max]))[0]))


class Shares(NamedTuple):
    """Levels and the seconds of measurement at each, settling left out."""

    levels: Floats
    seconds: Floats


def mean_heat(levels: Floats, dwells: Floats, course: Course, V_max: float) -> float:
    """Copper heat over the whole run, ramps and tares too, as a share of that at V_max.

    >>> round(mean_heat(np.array([10.0]), np.array([3.0]), Course(10.0, 0, 1.0, 2.0, 1.0), 10.0), 3)
    0.34
    """
    means, total = schedule(levels, dwells, course)
    V = means.voltage / V_max
    start, end = V[:-1], V[1:]
    ramp = sum(start**a * end ** (4 - a) for a in range(5)) / 5  # mean of V^4 on a straight line
    ramps = np.abs(np.diff(means.voltage)) / course.slew
    return float((ramp @ ramps + copper_heat(levels, V_max) @ dwells) / total)


@dataclass(frozen=True, slots=True)
class Spent:
    """What the last round found."""

    ratio: float
    """Seconds of the run for each second of mean, first tare and check holds left out of both."""
    returns: float
    """Tares, the first among them."""
    max_heat: float
    """Mean over the holds' means that keeps the run within its limit."""

    @staticmethod
    def guess(ask: Ask, net: float) -> Spent:
        return Spent(1.5 + ask.course.settle / net, 2.0, ask.max_heat)

    def after(self, ask: Ask, levels: Floats, dwells: Floats, checks: Floats) -> Spent:
        means, total = schedule(levels, dwells, ask.course)
        check = np.isin(levels, checks)
        net = float((dwells[~check] - ask.course.settle).sum())
        heat = mean_heat(levels, dwells, ask.course, ask.V_max)
        limit = self.max_heat * ask.max_heat / heat if heat > 0 else self.max_heat
        spent = (total - ask.course.tare - float(dwells[check].sum())) / net
        return Spent(spent, float(means.voltage.size - levels.size), limit)


def optimum(ask: Ask, spent: Spent, net: float, checks: Floats | None = None) -> Shares:
    """Continuous optimum over what is left of the time; tares and check holds count as information in hand."""
    V, terms = ask.candidates, ask.terms
    others = np.append(0.0, checks if checks is not None else [])
    fixed = ask.course.tare + (others.size - 1) * (net + ask.course.settle)
    left = (ask.total - fixed) / spent.ratio
    if left < ask.least_mean:
        raise PlanError(
            f"{ask.total:.4g} s are too short: the first tare and {others.size - 1} check levels alone take "
            f"{fixed:.3g} s; raise --time, or lower --check-levels, --max-dwell or the tares"
        )
    seconds = np.append(spent.returns * ask.course.tare, np.full(others.size - 1, net))
    H = terms.rows(others) / ask.noise.std(terms.thrust(others), seconds)[:, None]
    sigma = ask.noise.std(terms.thrust(V), np.full(V.size, net)) * np.sqrt(net)
    choices = Candidates(V, terms.rows(V), terms.names, sigma, copper_heat(V, ask.V_max))
    found = optimal_levels(choices, left, ask.criterion, spent.max_heat, terms.size(ask.V_max), H.T @ H, GOOD)
    if not isinstance(found, Design):
        raise PlanError(f"no run can be designed: {found.statement}")
    shares = Shares(found.levels, found.dwells)
    return shares if ask.only_these else _merged(shares, V)


def _merged(found: Shares, candidates: Floats) -> Shares:
    """Neighbours on the grid of candidates stand for one level between them, with the same mean V^4: of information
    about C and of heat."""
    at, side = np.searchsorted(candidates, found.levels), np.sign(found.levels)
    group = np.append(0, np.cumsum((np.diff(at) > 1) | (np.diff(side) != 0)))
    seconds = np.asarray(np.bincount(group, found.seconds), dtype=np.float64)
    fourth = np.bincount(group, found.seconds * found.levels**4) / seconds
    sign = side[np.unique(group, return_index=True)[1]]
    return Shares(np.round(sign * fourth**0.25, 2), seconds)


def long_enough(found: Shares, ask: Ask) -> Shares:
    """Without levels too short for a mean; their time goes to the others."""
    keep = found.seconds >= ask.least_mean
    if not keep.any():
        raise PlanError(f"{ask.total:.4g} s are too short for a mean of {ask.least_mean:.2g} s at each level")
    return Shares(found.levels[keep], found.seconds[keep] * found.seconds.sum() / found.seconds[keep].sum())


def check_levels_of(ask: Ask, support: Floats) -> Floats:
    """Farthest from the levels in use and from rest, one after the other; fewer when the candidates end."""
    used, out = np.append(support, 0.0), np.zeros(0)
    for _ in range(ask.check_levels):
        far = np.abs(ask.candidates[:, None] - np.append(used, out)).min(axis=1)
        if far.max() <= 1e-9:
            break
        out = np.append(out, ask.candidates[int(np.argmax(far))])
    return out
