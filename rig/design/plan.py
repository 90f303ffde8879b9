"""The best levels, order and dwells for a time in the tunnel: from the continuous optimum to holds that can be run."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from identification.experiment_design.experiment import Criterion
from identification.experiment_design.run_order import best_order, schedule, spread_out
from identification.experiment_design.thrust_design import Promise, promise
from identification.recording import Floats
from rig.campaign.plan_file import Level
from rig.design.optimal_levels import Ask, Spent, check_levels_of, long_enough, mean_heat, optimum
from rig.errors import PlanError

LEAST_REPEATS = 2
"""Holds of each level of the optimum: one that went wrong shall show against another."""
ROUNDS = 3
"""Of finding the weights for the time left, and the time left for the weights."""
SHORTER = (1.0, 0.6, 0.35)
"""Dwells tried, as shares of the longest allowed: shorter ones pay when a hold does not repeat well."""
QUICK = 60
"""Exchanges tried in search of the order, for each dwell length."""
STRETCHES = (1, 2, 4)
"""Zero returns between which the order goes from one end of the levels to the other, and then back."""
MARGIN = 0.9
"""Share of the longest dwell that is planned first: a better order leaves time that stretches the dwells."""
HEAT_MARGIN = 0.99
"""Of the limit that is aimed at anew when a run came out too hot."""
STEP = 0.05
"""s to which dwells are rounded, down."""


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


def worth(found: Promise, criterion: Criterion, size: Floats) -> float:
    """Variance that the criterion sees: geometric mean of the covariance's axes (D), sum of relative variances (A)."""
    if criterion == "D":
        return float(np.exp(np.linalg.slogdet(found.cov)[1] / len(found.names)))
    return float(np.sum(np.diag(found.cov) / size**2))


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
    spent = Spent.guess(ask, net)
    checks = check_levels_of(ask, optimum(ask, spent, net).levels)
    levels = dwells = np.zeros(0)
    for _ in range(ROUNDS):
        found = optimum(ask, spent, net, checks)
        found = long_enough(found, ask)
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
