"""A force of any shape over one covariate: whether what is left asks for it, where it acts, and as a term of the model.

It stands for physics that no term carries: over speed, command, time, place or heading, or from run to run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from identification.estimation.singular_values import thin_svd
from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import beyond, family_p_value, orthogonal_basis
from identification.mismatch.vehicle.fitting import Fit, fit
from identification.mismatch.vehicle.model import Layout, VehicleModel, layout_of, respond, with_term
from identification.mismatch.vehicle.runs import Prepared, Run
from identification.mismatch.vehicle.screening import whitened
from identification.mismatch.vehicle.search import State, refreshed
from identification.physics.term import Parameter
from identification.physics.vehicle.term import Body, Scale, Stage, Untouched, VehicleContext
from identification.recording import Floats
from identification.run_history.splines import spline

BUMPS = 6
"""Knots of a free force: as many as the quantiles of a run of minutes determine."""
BACK = 1e-300
"""Smallest p-value that is told: 0 has no logarithm."""
MOST = 5.0
"""Of the largest force: bound of a free force at a knot, beyond anything that acts."""
LOCAL = ("time", "run")
"""Coordinates that say nothing of other runs."""


@dataclass(frozen=True, eq=False)
class Covariate:
    """A covariate (g,) of each run on its grid, and the knots (b,) of a free force over it."""

    quantity: str
    unit: str
    values: tuple[Floats, ...]
    knots: Floats
    what: str

    def bumps(self, j: int) -> Floats:
        """(g, b): triangles that add up to one, flat beyond the ends; 0 where the covariate is not known."""
        out = spline(self.values[j], self.knots, np.eye(self.knots.size), 1)
        out[~np.isfinite(self.values[j])] = 0.0
        return out


@dataclass(frozen=True, eq=False)
class Structure:
    """A free force over one covariate, fitted to what remains."""

    covariate: Covariate
    p_value: float
    """Of this covariate alone."""
    share: float
    """Of the whitened residual's sum of squares."""
    force: Floats
    """(b,) N at the knots."""
    std: Floats
    beta: Floats
    """(b,) as fitted: `force` about its mean, which the model's own parameters may hold."""


def covariates(fitted: Fit, data: Prepared) -> tuple[Covariate, ...]:
    """What a force that was left out may depend on."""
    speed = tuple(_middle(m.v) for m in fitted.motions)
    place = tuple(_middle(m.x) for m in fitted.motions)
    time = tuple(_middle(run.edges) for run in data.runs)
    out = [
        _coordinate("speed", data.scale.speed_unit, speed, "a force over the speed"),
        _coordinate("command_voltage", "V", tuple(map(_command, data.runs)), "a force over the command"),
        _coordinate("time", "s", time, "a force over time"),
    ]
    if data.runs[0].quantity == "position":
        name = "depth" if data.scale.axis == "heave" else "position"
        out.append(_coordinate(name, data.scale.length_unit, place, "a force over the place"))
    if np.isfinite(data.scale.heading_spread) and data.scale.heading_spread > policy.vehicle.HEADING_SPREAD:
        psi = tuple(np.angle(np.exp(1j * run.moment.heading)) for run in data.runs)
        out.append(_coordinate("heading", "rad", psi, "a force over the heading"))
    if len(data.runs) > 1:
        out.append(_by_run(data))
    return tuple(one for one in out if one is not None)


def _middle(y: Floats) -> Floats:
    out: Floats = 0.5 * (y[1:] + y[:-1])
    return out


def _command(run: Run) -> Floats:
    """(g,) V: the mean over the thrusters that push, each as it pushes ahead."""
    sign = np.sign(run.arms)[:, None]
    out: Floats = np.mean(sign * run.moment.volts.mean(axis=2), axis=0)
    return out


def _coordinate(quantity: str, unit: str, values: tuple[Floats, ...], what: str) -> Covariate | None:
    whole = np.concatenate(values)
    whole = whole[np.isfinite(whole)]
    if whole.size == 0 or float(np.ptp(whole)) == 0:
        return None
    knots = np.unique(np.quantile(whole, np.linspace(0, 1, BUMPS)))
    span = float(np.ptp(whole))
    kept = [knots[0]]
    for knot in knots[1:]:
        if knot - kept[-1] > 0.03 * span:
            kept.append(knot)
    return Covariate(quantity, unit, values, np.array(kept), what) if len(kept) > 1 else None


def _by_run(data: Prepared) -> Covariate:
    index = tuple(np.full(run.steps, float(j + 1)) for j, run in enumerate(data.runs))
    return Covariate("run", "1", index, np.arange(1.0, len(data.runs) + 1), "a force that differs from run to run")


@dataclass(frozen=True, eq=False)
class Left:
    """Every covariate against the residual, the clearest first."""

    p_value: float
    """Family-wise, of the clearest."""
    structures: tuple[Structure, ...]


def free_columns(fitted: Fit, data: Prepared, covariate: Covariate) -> list[Floats]:
    """(n, b) per run: what a unit of force at each knot changes of the measurement."""
    layout, theta = fitted.layout, fitted.theta
    return [
        respond(layout, theta, data, j, fitted.motions[j], covariate.bumps(j))[:, :-2] for j in range(len(data.runs))
    ]


def judge_left(fitted: Fit, white: Weights, data: Prepared, rng: np.random.Generator) -> Left:
    """Does a free force over any covariate still explain something?"""
    base = orthogonal_basis(fitted.jacobian)
    residual = np.clip(fitted.residual, -policy.locate.OUTLIER_SIGMA, policy.locate.OUTLIER_SIGMA)
    total = float(residual @ residual)
    spans, found = [], []
    for covariate in covariates(fitted, data):
        columns = whitened(white, free_columns(fitted, data, covariate), residual.size)
        Q = beyond(columns, base)
        if not Q.shape[1]:
            continue
        gain = float(np.sum((Q.T @ residual) ** 2))
        p = max(float(chi2_sf(gain, Q.shape[1])), BACK)
        beta, std = _solved(columns, base, fitted.residual)
        spans.append(Q)
        found.append(Structure(covariate, p, gain / total, beta - beta.mean(), std, beta))
    if not found:
        return Left(1.0, ())
    p_value = family_p_value([one.p_value for one in found], spans, residual, rng)
    return Left(p_value, tuple(sorted(found, key=lambda one: (one.p_value, -one.share))))


def _solved(columns: Floats, base: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Forces at the knots and their standard errors; of what the model's parameters could hold too, the least."""
    left = columns - base @ (base.T @ columns)
    U, s, Vt = thin_svd(left)
    kept = s > 1e-5 * s[0]
    inverse = Vt[kept].T / s[kept]
    return inverse @ (U[:, kept].T @ residual), np.sqrt(np.sum(inverse**2, axis=1))


@dataclass(frozen=True, eq=False)
class Place:
    """Where most of it lies."""

    low: float
    high: float
    table: tuple[tuple[float, float, float], ...]


def place_of(structure: Structure) -> Place:
    """From the knot before to the one after the stretch with most force, in standard errors."""
    knots = structure.covariate.knots
    weight = np.abs(structure.force) / np.where(structure.std > 0, structure.std, np.inf)
    i = int(np.argmax(weight))
    last = knots.size - 1
    low, high = float(knots[max(i - 1, 0)]), float(knots[min(i + 1, last)])
    if structure.covariate.quantity == "run":
        low = high = float(knots[i])
    rows = zip(knots.tolist(), structure.force.tolist(), structure.std.tolist(), strict=True)
    return Place(low, high, tuple(rows))


@dataclass(frozen=True, eq=False, slots=True)
class FreeForce(Untouched):
    """N at the knots, straight lines between."""

    id: ClassVar[str] = "free_force"
    stage: ClassVar[Stage] = "body"
    physics: ClassVar[str] = "a force that no effect of the catalogue carries"
    form: ClassVar[str] = ""
    covariate: Covariate
    bumps: Mapping[str, Floats]
    """run -> (g, b), or (g, b - 1) with a reference"""
    reference: int | None = None
    """Knot at which the force is 0: beside a steady force of another term the two would be one. None: there is none."""

    @property
    def knots(self) -> Floats:
        """Those with a parameter."""
        at = self.covariate.knots
        return at if self.reference is None else np.delete(at, self.reference)

    @property
    def covariates(self) -> tuple[str, ...]:
        return (self.covariate.quantity,)

    def parameters(self, scale: Scale) -> tuple[Parameter, ...]:
        most = MOST * scale.force
        return tuple(Parameter(f"at[{knot:.3g}]", scale.force_unit, -most, most, 0.0) for knot in self.knots)

    def trials(self, scale: Scale) -> tuple[tuple[float, ...], ...]:
        return ((0.01 * scale.force,) * self.knots.size,)

    def on_body(self, body: Body, now: VehicleContext, theta: tuple[float, ...]) -> Body:
        bumps = self.bumps.get(now.run)
        return body if bumps is None else replace(body, steady=body.steady + bumps @ theta)

    def statement(self, theta: tuple[float, ...], scale: Scale) -> str:
        most = max(map(abs, theta))
        over_what = self.covariate.quantity.replace("_", " ")
        return (
            f"A force over {over_what}, up to {most:.3g} {scale.force_unit}, that no effect of the catalogue carries."
        )


def over(covariate: Covariate, data: Prepared, reference: int | None = None) -> FreeForce:
    """A free force over a covariate of these runs."""
    bumps = {run.recording_id: covariate.bumps(j) for j, run in enumerate(data.runs)}
    if reference is not None:
        bumps = {name: np.delete(one, reference, axis=1) for name, one in bumps.items()}
    return FreeForce(covariate, bumps, reference)


def with_free_force(state: State, data: Prepared, structure: Structure) -> State:
    """The model with a free force over the covariate that is clearest, everything fitted anew."""
    steady = any(term.id == "buoyancy_offset" for term in state.terms)
    term = over(structure.covariate, data, structure.covariate.knots.size // 2 if steady else None)
    zeros = [0.0] * term.knots.size
    layout, theta = with_term(state.fit.layout, data, state.fit.theta, term, zeros)
    return refreshed(fit(layout, theta, data, state.white, state.fit.motions), data, ())


def free_force_of(layout: Layout) -> FreeForce | None:
    """The term that is a free force."""
    return next((term for term in layout.parts if isinstance(term, FreeForce)), None)


def carried(layout: Layout, term: FreeForce, bare: Fit, unseen: Prepared) -> Layout:
    """The same model for other runs, whose covariate is taken from `bare`: their motion without the free force."""
    there = next((c for c in covariates(bare, unseen) if c.quantity == term.covariate.quantity), None)
    known = there is not None and there.quantity not in LOCAL
    moved = (
        over(replace(there, knots=term.covariate.knots), unseen, term.reference)
        if known and there
        else replace(term, bumps={})
    )
    return layout_of(VehicleModel(tuple(moved if t is term else t for t in layout.parts)), unseen)
