"""The best levels, order and dwells for a time in the tunnel: from the continuous optimum to holds that can be run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.experiment import Candidates, Criterion, Design, copper_heat, optimal_levels
from identification.recording import Floats
from identification.run_order import Course, Setting, Slow, best_order, schedule, spread_out
from identification.thrust_design import Noise, Promise, Terms, promise
from rig.errors import PlanError
from rig.plan_file import Level

GOOD = 2e-3
"""Loss of efficiency allowed to the continuous optimum: whole holds lose more."""
LEAST_REPEATS = 2
"""Holds of each level of the optimum: one that went wrong shall show against another."""
ROUNDS = 3
"""Of finding the weights for the time left, and the time left for the weights."""
SHORTER = (1.0, 0.6, 0.35)
"""Dwells tried, as shares of the longest allowed: shorter ones pay when a hold does not repeat well."""
QUICK, THOROUGH = 60, 1500
"""Exchanges tried in search of the order: for each dwell length, and for the chosen one."""
STRETCHES = (1, 2, 4)
"""Zero returns between which the order goes from one end of the levels to the other, and then back."""
DRIFT = 1e-3
"""Of the highest thrust: drift over a run that the order is made for, if nothing better is known."""
MARGIN = 0.9
"""Share of the longest dwell that is planned first: a better order leaves time that stretches the dwells."""
HEAT_MARGIN = 0.99
"""Of the limit that is aimed at anew when a run came out too hot."""
STEP = 0.05
"""s to which dwells are rounded, down."""


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


@dataclass(frozen=True, eq=False)
class Chosen:
    """Holds in order, with what they promise."""

    levels: Floats
    """(k,) V"""
    dwells: Floats
    """(k,) s, settling included."""
    checks: Floats
    """Levels that are there for lack of fit only."""
    promise: Promise
    value: float
    """Of the criterion: less is better; see `worth`."""

    @property
    def steps(self) -> tuple[Level, ...]:
        return tuple(Level(float(v), float(s)) for v, s in zip(self.levels, self.dwells, strict=True))


class Shares(NamedTuple):
    """Levels and the seconds of measurement at each, settling left out."""

    levels: Floats
    seconds: Floats


def worth(found: Promise, criterion: Criterion, size: Floats) -> float:
    """Variance that the criterion sees: geometric mean of the covariance's axes (D), sum of relative variances (A)."""
    if criterion == "D":
        return float(np.exp(np.linalg.slogdet(found.cov)[1] / len(found.names)))
    return float(np.sum(np.diag(found.cov) / size**2))


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


def choose(ask: Ask) -> Chosen:
    """Levels, order and dwells. Raises PlanError with one sentence when the limits leave no run."""
    _require_choice(ask)
    length, inner = _best_length(ask), ask
    for _ in range(ROUNDS):
        found = _filled(ask, _trial(inner, length), ask.tries)
        heat = mean_heat(found.levels, found.dwells, ask.course, ask.V_max)
        if heat <= ask.max_heat:
            return found
        inner = replace(inner, max_heat=HEAT_MARGIN * inner.max_heat * ask.max_heat / heat)
    raise PlanError(
        f"the mean heat cannot be kept below {ask.max_heat:.3g} of that at {ask.V_max:g} V: {heat:.3g} was the least "
        "found; lower --check-levels or raise the limit"
    )


def _best_length(ask: Ask) -> float:
    """Length of the holds in s, tried with orders that are searched for quickly."""
    lengths = [share * ask.max_dwell for share in SHORTER if share * ask.max_dwell >= _shortest(ask)]
    if not lengths:
        raise PlanError(
            f"dwells of at most {ask.max_dwell:g} s leave no measurement: {ask.course.settle:g} s of settling and "
            f"{ask.least_mean:.2g} s of mean are needed; raise --max-dwell or lower --settle"
        )
    trials, refused = [], []
    for length in lengths:
        try:
            trials.append((_filled(ask, _trial(ask, length), QUICK).value, length))
        except PlanError as error:
            refused.append(error)
    if not trials:
        raise refused[-1]
    return min(trials)[1]


def _shortest(ask: Ask) -> float:
    return ask.course.settle + ask.least_mean


def _require_choice(ask: Ask) -> None:
    levels = np.unique(ask.candidates[ask.candidates != 0.0])
    if levels.size < 2:
        said = "no level but 0 V is" if levels.size == 0 else f"only one level is ({levels[0]:g} V)"
        raise PlanError(
            f"{said} allowed by the limits of voltage and thrust: at least two are needed, or nothing judges the model"
        )


def _trial(ask: Ask, length: float) -> Chosen:
    """Holds of about `length` s that fill the time."""
    net = length - ask.course.settle
    spent = _Spent.guess(ask, net)
    checks = _check_levels(ask, _optimum(ask, spent, net).levels)
    levels = dwells = np.zeros(0)
    for _ in range(ROUNDS):
        found = _optimum(ask, spent, net, checks)
        found = _long_enough(found, ask)
        counts = np.maximum(LEAST_REPEATS, np.ceil(found.seconds / (MARGIN * net) - 1e-6))
        counts = np.minimum(counts, np.maximum(1, np.floor(found.seconds / ask.least_mean)))
        each = np.append(found.seconds / counts, np.full(checks.size, MARGIN * net)) + ask.course.settle
        every, often = np.append(found.levels, checks), np.append(counts, np.ones(checks.size))
        levels, dwells = _ordered(ask, every, often, each)
        spent = spent.after(ask, levels, dwells, checks)
    return _judged(ask, levels, dwells, checks)


def _ordered(ask: Ask, levels: Floats, counts: Floats, each: Floats) -> tuple[Floats, Floats]:
    """Holds and dwells: the best of some evenly spread orders."""
    starts = []
    for stretch in STRETCHES:
        V = spread_out(levels, counts, stretch * ask.course.zero_every)
        dwells: Floats = each[np.argmax(V[:, None] == levels, axis=1)]
        starts.append((ask.setting.loss(V, dwells), V, dwells))
    _, V, dwells = min(starts, key=lambda start: start[0])
    return V, dwells


@dataclass(frozen=True, slots=True)
class _Spent:
    """What the last round found."""

    ratio: float
    """Seconds of the run for each second of mean, first tare and check holds left out of both."""
    returns: float
    """Tares, the first among them."""
    max_heat: float
    """Mean over the holds' means that keeps the run within its limit."""

    @staticmethod
    def guess(ask: Ask, net: float) -> _Spent:
        return _Spent(1.5 + ask.course.settle / net, 2.0, ask.max_heat)

    def after(self, ask: Ask, levels: Floats, dwells: Floats, checks: Floats) -> _Spent:
        means, total = schedule(levels, dwells, ask.course)
        check = np.isin(levels, checks)
        net = float((dwells[~check] - ask.course.settle).sum())
        heat = mean_heat(levels, dwells, ask.course, ask.V_max)
        limit = self.max_heat * ask.max_heat / heat if heat > 0 else self.max_heat
        spent = (total - ask.course.tare - float(dwells[check].sum())) / net
        return _Spent(spent, float(means.voltage.size - levels.size), limit)


def _optimum(ask: Ask, spent: _Spent, net: float, checks: Floats | None = None) -> Shares:
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


def _long_enough(found: Shares, ask: Ask) -> Shares:
    """Without levels too short for a mean; their time goes to the others."""
    keep = found.seconds >= ask.least_mean
    if not keep.any():
        raise PlanError(f"{ask.total:.4g} s are too short for a mean of {ask.least_mean:.2g} s at each level")
    return Shares(found.levels[keep], found.seconds[keep] * found.seconds.sum() / found.seconds[keep].sum())


def _check_levels(ask: Ask, support: Floats) -> Floats:
    """Farthest from the levels in use and from rest, one after the other; fewer when the candidates end."""
    used, out = np.append(support, 0.0), np.zeros(0)
    for _ in range(ask.check_levels):
        far = np.abs(ask.candidates[:, None] - np.append(used, out)).min(axis=1)
        if far.max() <= 1e-9:
            break
        out = np.append(out, ask.candidates[int(np.argmax(far))])
    return out


def _filled(ask: Ask, trial: Chosen, tries: int) -> Chosen:
    """In a good order, and with the seconds that this order leaves."""
    order = best_order(trial.levels, trial.dwells, ask.setting, tries, np.random.default_rng(ask.seed))
    levels, dwells = trial.levels[order], trial.dwells[order]
    settle = ask.course.settle
    net = dwells - settle
    _, total = schedule(levels, dwells, ask.course)
    stretched = net * max(0.0, 1 + (ask.total - total) / float(net.sum()))
    rounded = np.floor(np.minimum(settle + stretched, ask.max_dwell) / STEP + 1e-6) * STEP
    if rounded.min() < _shortest(ask) - STEP:
        short = schedule(levels, np.maximum(dwells, _shortest(ask)), ask.course)[1]
        raise PlanError(
            f"{ask.total:.4g} s are too short: with {levels.size} holds the run takes about {short:.0f} s; raise "
            "--time, or lower --check-levels or the tares"
        )
    rounded = np.maximum(np.round(rounded, 6), np.ceil(_shortest(ask) / STEP - 1e-6) * STEP)
    return _judged(ask, levels, rounded, trial.checks)


def _judged(ask: Ask, levels: Floats, dwells: Floats, checks: Floats) -> Chosen:
    found = promise(schedule(levels, dwells, ask.course)[0], ask.terms, ask.noise)
    if not isinstance(found, Promise):
        raise PlanError(f"no run can be designed: {found.statement}")
    return Chosen(levels, dwells, checks, found, worth(found, ask.criterion, ask.terms.size(ask.V_max)))


def without_checks(ask: Ask) -> Chosen | None:
    """The same with all time for the model's parameters; None when no run is possible so."""
    try:
        return choose(replace(ask, check_levels=0))
    except PlanError:
        return None
