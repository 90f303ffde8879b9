"""The baseline with terms added: its parameters, and a prediction with its slopes over every one of them.

Baseline of one axis: m v' = -k2 |v| v + sum over thrusters of arm x thrust. Parameters are k2; m where it is not stated
(or stated with an uncertainty); a factor of each thruster's model where that is uncertain; and per run the velocity and
the position at its start, which are nuisance. Where neither mass nor thrust is known, forces are per kg: m is 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.vehicle.motion import Motion, changes, left_over, linearised, moved, observed
from identification.mismatch.vehicle.runs import Prepared, Run
from identification.physics.term import Parameter
from identification.physics.vehicle.term import STAGES, Body, VehicleTerm
from identification.recording import Floats

FASTEST = 2.0
"""Times the largest speed measured."""
DIFFERENCE = 1e-5
"""Of a parameter's size: step of the differences over the forces (the motion's slopes are exact)."""


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of parameters beforehand: rows of a least-squares problem. (q, p) and (q,)."""

    rows: Floats
    right: Floats


@dataclass(frozen=True, eq=False)
class VehicleModel:
    """Terms in any order; they act in that of their stages."""

    terms: tuple[VehicleTerm, ...] = ()

    def ordered(self) -> tuple[VehicleTerm, ...]:
        return tuple(sorted(self.terms, key=lambda t: STAGES.index(t.stage)))


@dataclass(frozen=True, eq=False)
class Layout:
    """Where each parameter stands in theta: baseline, terms, then two numbers for the start of each run."""

    model: VehicleModel
    base: tuple[Parameter, ...]
    parts: Mapping[VehicleTerm, tuple[Parameter, ...]]
    """Parameters of each term."""
    runs: int
    fastest: float
    """Speed beyond which no run can have begun: a wild start would pass for a shift of the place."""

    def of(self, term: VehicleTerm) -> slice:
        """Where the parameters of a term stand."""
        before = list(self.parts).index(term)
        begin = len(self.base) + sum(map(len, list(self.parts.values())[:before]))
        return slice(begin, begin + len(self.parts[term]))

    def values(self, theta: Floats) -> dict[VehicleTerm, tuple[float, ...]]:
        """The values of each term."""
        return {term: tuple(theta[self.of(term)].tolist()) for term in self.parts}

    @property
    def starts(self) -> int:
        """Index of the first run's velocity."""
        return len(self.base) + sum(map(len, self.parts.values()))

    @property
    def size(self) -> int:
        return self.starts + 2 * self.runs

    def bounds(self) -> tuple[Floats, Floats]:
        inside = [*self.base, *(p for part in self.parts.values() for p in part)]
        low = [p.low for p in inside] + [-self.fastest, -np.inf] * self.runs
        high = [p.high for p in inside] + [self.fastest, np.inf] * self.runs
        return np.array(low), np.array(high)


def layout_of(model: VehicleModel, data: Prepared) -> Layout:
    """The parameters of a model for these runs: which of the baseline are free follows from what is known of mass and
    thrusters.
    """
    scale = data.scale
    mass = _typical_mass(data)
    base = [Parameter("k2", scale.over(f"({scale.speed_unit})^2"), 0.0, 1e3 * scale.force / scale.speed**2)]
    if not scale.per_kg and (data.mass is None or data.mass.std > 0):
        base.append(Parameter("m", scale.mass_unit, 1e-3 * mass, 1e3 * mass))
    values = data.installation.coefficients
    for thruster, at in zip(data.installation.thrusters, _coefficients(data), strict=True):
        if any(data.installation.cov[i, i] > 0 for i in at):
            base.append(Parameter(f"C[{thruster.name}]", "1", 0.0, 1e3 if np.any(values[list(at)] != 0) else 1.0))
    parts = {term: term.parameters(scale) for term in model.terms}
    return Layout(model, tuple(base), parts, len(data.runs), FASTEST * scale.speed)


def _coefficients(data: Prepared) -> tuple[tuple[int, ...], ...]:
    return data.runs[0].basis


def _typical_mass(data: Prepared) -> float:
    """kg: what the largest force brings to the largest speed within a twentieth of the longest run."""
    if data.mass is not None:
        return data.mass.value
    scale = data.scale
    return scale.force / scale.speed * 0.05 * scale.duration


def known(layout: Layout, data: Prepared) -> Known:
    """Stated mass and the calibration of the thrusters, with its covariance, as rows for theta."""
    names = [p.name for p in layout.base]
    rows, right = [], []
    if data.mass is not None and "m" in names:
        row = np.zeros(layout.size)
        row[names.index("m")] = 1 / data.mass.std
        rows.append(row)
        right.append(data.mass.value / data.mass.std)
    factors = [i for i, name in enumerate(names) if name.startswith("C[")]
    if factors and data.scale.thrust_known:
        lead = _leading(data, [names[i] for i in factors])
        values = data.installation.coefficients[lead]
        cov = data.installation.cov[np.ix_(lead, lead)] / np.outer(values, values)
        root = np.linalg.inv(np.linalg.cholesky(cov + 1e-18 * np.eye(len(lead))))
        for line in root:
            row = np.zeros(layout.size)
            row[factors] = line
            rows.append(row)
            right.append(float(line.sum()))
    return Known(np.array(rows).reshape(-1, layout.size), np.array(right))


def _leading(data: Prepared, names: Sequence[str]) -> list[int]:
    """Index of the largest coefficient of each of these thrusters: its relative error stands for all of them."""
    out = []
    for thruster, at in zip(data.installation.thrusters, _coefficients(data), strict=True):
        if f"C[{thruster.name}]" in names:
            out.append(max(at, key=lambda i: abs(data.installation.coefficients[i])))
    return out


def begin(layout: Layout, data: Prepared) -> Floats:
    """Where a fit may start: half of the largest force is drag at the largest speed; runs start as measured."""
    theta = np.zeros(layout.size)
    scale = data.scale
    guess = {"k2": 0.5 * scale.force / scale.speed**2, "m": _typical_mass(data)}
    for i, p in enumerate(layout.base):
        theta[i] = guess.get(p.name, 1.0)
    for term, part in layout.parts.items():
        theta[layout.of(term)] = [p.neutral or 0.0 for p in part]
    for j, run in enumerate(data.runs):
        n = min(5, run.time.size)
        slope, level = np.polyfit(run.time[:n] - run.start, run.response[:n], 1)
        theta[layout.starts + 2 * j :][:2] = (level, 0.0) if run.quantity == "speed" else (slope, level)
    return theta


def push_of(layout: Layout, theta: Floats, run: Run) -> Floats:
    """(g,) N on the axis, the mean over each step."""
    volts = run.moment.volts
    ordered = layout.model.ordered()
    values = layout.values(theta)
    for term in ordered:
        if term.stage == "command":
            volts = term.on_volts(volts, run.moment, values[term])
    thrust = _thrust(layout, theta, run, volts)
    for term in ordered:
        if term.stage == "thrust":
            thrust = term.on_thrust(thrust, run.moment, values[term])
    whole = np.tensordot(run.arms, thrust, axes=1)
    return np.asarray(whole @ np.full(whole.shape[1], 1 / whole.shape[1]))


def _thrust(layout: Layout, theta: Floats, run: Run, volts: Floats) -> Floats:
    """(T, g, S) N of each thruster alone."""
    names = {p.name: i for i, p in enumerate(layout.base)}
    out = np.empty(volts.shape)
    for t, thruster in enumerate(run.installation.thrusters):
        factor = theta[names[f"C[{thruster.name}]"]] if f"C[{thruster.name}]" in names else 1.0
        one = thruster.coefficients @ thruster.basis(volts[t].ravel())
        out[t] = factor * one.reshape(volts[t].shape)
    return out


def body_of(layout: Layout, theta: Floats, run: Run, data: Prepared) -> Body:
    """Mass, drags and steady forces of a run at the parameters `theta` (p,), what every term adds to them included."""
    names = {p.name: i for i, p in enumerate(layout.base)}
    mass = 1.0 if data.scale.per_kg else theta[names["m"]] if "m" in names else data.mass.value if data.mass else 1.0
    body = Body(mass=float(mass), quadratic=float(theta[names["k2"]]))
    for term, values in layout.values(theta).items():
        if term.stage == "body":
            body = term.on_body(body, run.moment, values)
    return body


def origin_of(run: Run) -> float:
    """m, where the line comes from: the surface for a depth, otherwise where the run began."""
    return 0.0 if run.moment.scale.axis == "heave" or run.quantity == "speed" else float(run.response[0])


@dataclass(frozen=True, eq=False)
class Prediction:
    """One run as the model has it, and what its parameters change."""

    motion: Motion
    response: Floats
    """(n,)"""
    slopes: Floats
    """(n, p) over theta."""


def predict(layout: Layout, theta: Floats, data: Prepared, j: int, guess: Motion | None, slopes: bool) -> Prediction:
    """Run j. `guess`: a motion nearby, if one is at hand. Without `slopes` those are empty."""
    run = data.runs[j]
    body, push = body_of(layout, theta, run, data), push_of(layout, theta, run)
    v0, x0 = theta[layout.starts + 2 * j :][:2]
    motion = moved(body, push, run.moment.step, v0, x0, origin_of(run), None if guess is None else guess.v)
    response = observed(run, motion.v, motion.x)
    if not slopes:
        return Prediction(motion, response, np.empty((run.time.size, 0)))
    forces = added_forces(layout, theta, data, j, motion)
    whole = respond(layout, theta, data, j, motion, forces)
    H = np.zeros((run.time.size, layout.size))
    H[:, : layout.starts] = whole[:, :-2]
    H[:, layout.starts + 2 * j :][:, :2] = whole[:, -2:]
    return Prediction(motion, response, H)


def respond(layout: Layout, theta: Floats, data: Prepared, j: int, motion: Motion, forces: Floats) -> Floats:
    """(n, q + 2): what small added forces (g, q), and speed and place at the start, change of run j's measurement."""
    run = data.runs[j]
    here = linearised(body_of(layout, theta, run, data), motion, run.moment.step, origin_of(run))
    return observed(run, *changes(here, forces))


def added_forces(layout: Layout, theta: Floats, data: Prepared, j: int, motion: Motion) -> Floats:
    """(g, starts): slope over each parameter of the force that the motion as it is would need more."""
    run = data.runs[j]
    low, high = layout.bounds()
    out = np.empty((run.steps, layout.starts))
    push, body = push_of(layout, theta, run), body_of(layout, theta, run, data)
    base = -left_over(body, push, motion, run.moment.step, origin_of(run))
    for i in range(layout.starts):
        size = DIFFERENCE * max(abs(theta[i]), 1e-2 * min(high[i] - low[i], 1e3 * max(abs(theta[i]), 1e-3)))
        d = size if theta[i] + size <= high[i] else -size
        moved_theta = theta.copy()
        moved_theta[i] += d
        if _pushes(layout, i):
            out[:, i] = (push_of(layout, moved_theta, run) - push) / d
            continue
        moved_body = body_of(layout, moved_theta, run, data)
        out[:, i] = (-left_over(moved_body, push, motion, run.moment.step, origin_of(run)) - base) / d
    return out


def _pushes(layout: Layout, i: int) -> bool:
    """Whether parameter i enters through the thrusters."""
    if i < len(layout.base):
        return layout.base[i].name.startswith("C[")
    return next(term for term in layout.parts if layout.of(term).stop > i).stage != "body"


def with_term(
    layout: Layout, data: Prepared, theta: Floats, term: VehicleTerm, values: Sequence[float]
) -> tuple[Layout, Floats]:
    """The same model and parameters with one term more."""
    new = layout_of(VehicleModel((*layout.model.terms, term)), data)
    return new, np.concatenate([theta[: layout.starts], values, theta[layout.starts :]])


def without_term(layout: Layout, data: Prepared, theta: Floats, term: VehicleTerm) -> tuple[Layout, Floats]:
    """The same model and parameters with one term less."""
    new = layout_of(VehicleModel(tuple(t for t in layout.model.terms if t != term)), data)
    return new, np.delete(theta, layout.of(term))


def on_other_runs(layout: Layout, data: Prepared, theta: Floats) -> tuple[Layout, Floats]:
    """The same model for other runs: their starts as measured, everything else as it is."""
    new = replace(layout, runs=len(data.runs))
    start = begin(new, data)
    start[: new.starts] = theta[: layout.starts]
    return new, start
