"""The calibration of a load cell: curve with covariance, gain with its interval, budget by contribution.

The gain is the slope of the best straight line through the zero over the calibrated range. Its uncertainty is the
root of the squares of its contributions (JCGM 100:2008, 5), its coverage factor Student's at the effective degrees of
freedom by Welch and Satterthwaite (the same, G.4).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, sqrt

import numpy as np

from identification.calibration.curve import TERMS, Curve
from identification.calibration.estimate import Estimated, creep_time, estimated
from identification.calibration.loads import Forces, Load, Place, Source, Weight, forces_of
from identification.calibration.model import CREEP, POWER, straight_line
from identification.calibration.steps import Steps
from identification.calibration.wrong_weight import WrongStep, doubtful_steps
from identification.estimation.tails import fisher_sf, student_quantile, student_sf
from identification.recording import Floats

LEVEL = 0.95
CREEPS = 0.01
"""Probability that a cell without creep is said to have one."""


@dataclass(frozen=True, slots=True)
class Contribution:
    """What one source adds to the uncertainty of the gain."""

    name: str
    kind: str
    """A: from scatter; B: from what is stated (JCGM 100, 4.2 and 4.3)."""
    std: float
    """N/N"""
    dof: float


@dataclass(frozen=True, slots=True)
class TermFound:
    """One term of the model with its standard uncertainty, scatter and stated sources together."""

    name: str
    value: float
    std: float
    unit: str
    p_value: float
    """Of a value so far from nothing (of the gain: from 1) by scatter alone."""


@dataclass(frozen=True, slots=True)
class Gain:
    """N of reading per N of force."""

    value: float
    std: float
    low: float
    high: float
    coverage: float
    """k: the half width of the 95 % interval over `std`."""
    dof: float
    """Effective."""


@dataclass(frozen=True, eq=False)
class CellCalibration:
    """All that is known of a cell by its dead weights."""

    curve: Curve
    gain: Gain
    budget: tuple[Contribution, ...]
    terms: tuple[TermFound, ...]
    time_constant: float | None
    """s of the creep; None: none is seen."""
    age: float
    """s from loading to reading, to which the curve belongs."""
    temperature: float
    """degC, mean; NaN where nobody measured."""
    scatter: float
    """N of one step about the curve."""
    dof: float
    residual: Floats
    """(n,) N, of the steps that are believed."""
    wrong: tuple[WrongStep, ...]
    """Steps that are not to be believed: all else is of the others."""

    def term(self, name: str) -> TermFound | None:
        """None for one that was not asked for."""
        return next((term for term in self.terms if term.name == name), None)

    def force_interval(self, reading: float) -> tuple[float, float, float]:
        """N: force of a reading on the curve, and its 95 % interval; hysteresis and creep of the run are in it."""
        force = self.curve.force(reading)
        std = float(np.linalg.norm(self.curve.effects(np.array([force]))))
        half = float(student_quantile(0.5 + LEVEL / 2.0, min(self.curve.dof, 1e6))) * std
        return force, force - half, force + half


def calibrated(
    steps: Steps,
    loads: Sequence[Load],
    weights: Mapping[str, Weight],
    place: Place,
    *,
    correlation: float = 1.0,
    quantum: float = 0.0,
    stability: float = 0.0,
) -> CellCalibration:
    """From the readings of steps whose force is that of `loads`, made by `weights` at `place`.

    `quantum`: N, step of the readings. `stability`: relative standard uncertainty of what the gain does until the next
    calibration. Raises ValueError with a sentence when the steps tell no gain.
    """
    wrong = doubtful_steps(steps, loads, weights, place)
    kept = np.isin(np.arange(steps.count), [each.step for each in wrong], invert=True)
    believed = [load for load, good in zip(loads, kept, strict=True) if good]
    forces = forces_of(believed, weights, place, correlation)
    return replace(answered(steps.without(kept), forces, quantum, stability), wrong=wrong)


def answered(steps: Steps, forces: Forces, quantum: float = 0.0, stability: float = 0.0) -> CellCalibration:
    """The same for forces with any sources; no step is judged wrong. Raises ValueError as `estimated`."""
    fit = estimated(steps)
    low, high = min(0.0, float(steps.force.min())), max(0.0, float(steps.force.max()))
    slope = _slopes(fit)
    sources = (
        *(Source(each.name, -fit.solver @ (slope[:, None] * each.effect), each.dof) for each in forces.sources),
        Source("resolution of the reading", fit.solver * (quantum / sqrt(12.0))),
        Source("stability until the next one", _by_stability(fit, stability)),
    )
    cov = fit.cov + sum((each.effect @ each.effect.T for each in sources), np.zeros_like(fit.cov))
    line = _line(fit, straight_line(low, high))
    budget = _budget(fit, line, sources)
    creep = _creep(fit)
    gain = _gain(float(line @ fit.theta), budget)
    return CellCalibration(
        curve=_curve(fit, cov, (low, high), gain.dof, creep),
        gain=gain,
        budget=budget,
        terms=(*(_term(fit, cov, name) for name in fit.names if name not in CREEP), *([creep] if creep else [])),
        time_constant=creep_time(steps) if creep and creep.p_value < CREEPS else None,
        age=steps.age,
        temperature=float(np.mean(steps.temperature)),
        scatter=fit.scatter,
        dof=fit.dof,
        residual=fit.residual,
        wrong=(),
    )


def _slopes(fit: Estimated) -> Floats:
    """(n,) N/N at the force of each step."""
    F = fit.steps.force
    bends = 2.0 * fit.value("even") * F + 2.0 * fit.value("odd") * np.abs(F) + 3.0 * fit.value("cubic") * F**2
    out: Floats = fit.value("gain") + bends
    return out


def _by_stability(fit: Estimated, stability: float) -> Floats:
    out = np.zeros((len(fit.names), 1))
    for name in TERMS:
        if name in fit.names:
            out[fit.names.index(name), 0] = stability * fit.value(name)
    return out


def _line(fit: Estimated, weights: Floats) -> Floats:
    """(p,): the gain over the range as a sum of the terms."""
    out = np.zeros(len(fit.names))
    for name, weight in zip(TERMS, weights, strict=True):
        if name in fit.names:
            out[fit.names.index(name)] = weight
    return out


def _budget(fit: Estimated, line: Floats, sources: Sequence[Source]) -> tuple[Contribution, ...]:
    scatter = Contribution("repeatability and scatter", "A", float(np.sqrt(line @ fit.cov @ line)), float(fit.dof))
    stated = [Contribution(each.name, "B", float(np.linalg.norm(line @ each.effect)), each.dof) for each in sources]
    return (scatter, *(each for each in stated if each.std > 0.0))


def effective_dof(budget: Sequence[Contribution]) -> float:
    """Welch-Satterthwaite (JCGM 100, G.2b).

    >>> round(effective_dof([Contribution("a", "A", 3.0, 8), Contribution("b", "B", 4.0, inf)]), 3)
    61.728
    """
    total = sum(each.std**2 for each in budget)
    below = sum(each.std**4 / each.dof for each in budget if isfinite(each.dof))
    return float(total**2 / below) if below > 0.0 else inf


def _gain(value: float, budget: Sequence[Contribution]) -> Gain:
    std, dof = sqrt(sum(each.std**2 for each in budget)), effective_dof(budget)
    coverage = float(student_quantile(0.5 + LEVEL / 2.0, min(dof, 1e6)))
    return Gain(value, std, value - coverage * std, value + coverage * std, coverage, dof)


def _creep(fit: Estimated) -> TermFound | None:
    """By how much more than at the usual age a cell reads that has been loaded for long, as a share of the load."""
    if any(name not in fit.names for name in CREEP):
        return None
    at = [fit.names.index(name) for name in CREEP]
    left = np.exp([-1.0 / ages for ages in CREEP.values()])
    cov = fit.cov[np.ix_(at, at)]
    ratio = float(fit.theta[at] @ np.linalg.pinv(cov) @ fit.theta[at]) / len(at)
    p_value = float(fisher_sf(ratio, len(at), fit.dof))
    return TermFound("creep", float(left @ fit.theta[at]), float(np.sqrt(left @ cov @ left)), "1", p_value)


def _curve(fit: Estimated, cov: Floats, ends: tuple[float, float], dof: float, creep: TermFound | None) -> Curve:
    at = [fit.names.index(name) if name in fit.names else -1 for name in TERMS]
    full = np.array([[float(cov[i, j]) if min(i, j) >= 0 else 0.0 for j in at] for i in at])
    full = 0.5 * (full + full.T)
    gain, even, odd, cubic = (fit.value(name) for name in TERMS)
    width = 0.0
    if creep is not None:
        at_once = creep.value - sum(fit.value(name) for name in CREEP)
        width = max(abs(creep.value), abs(at_once)) if creep.p_value < CREEPS else creep.std
    return Curve(
        fit.value("zero"),
        (gain, even, odd, cubic),
        tuple(tuple(float(each) for each in row) for row in full),
        *ends,
        dof,
        abs(fit.value("lag")),
        abs(fit.value("remanence")),
        width,
    )


def _term(fit: Estimated, cov: Floats, name: str) -> TermFound:
    at, value = fit.names.index(name), fit.value(name)
    away, scatter = value - (name == "gain"), fit.std(name)
    p_value = 2.0 * float(student_sf(abs(away) / scatter, fit.dof)) if scatter > 0.0 else 0.0
    return TermFound(name, value, float(np.sqrt(cov[at, at])), _unit(name), p_value)


def _unit(name: str) -> str:
    """Of a term of a reading in N."""
    if name == "drift":
        return "N/s"
    power = POWER.get(name, 0)
    base = ("N", "1", "1/N", "1/N^2")[power]
    kelvin = {"N": "N/K", "1": "1/K"}
    return kelvin[base] if name.endswith("temperature") else base
