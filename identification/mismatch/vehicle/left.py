"""What is left that no term carries: a free force over speed, command, time, place or heading, and where it acts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.estimation.singular_values import thin_svd
from identification.estimation.tails import chi2_sf
from identification.mismatch import policy
from identification.mismatch.model.whitening import Weights
from identification.mismatch.name.naming import difference
from identification.mismatch.select.family_wise import beyond, family_p_value, orthogonal_basis
from identification.mismatch.vehicle.fitting import Fit
from identification.mismatch.vehicle.model import added_forces, respond
from identification.mismatch.vehicle.motion import Motion
from identification.mismatch.vehicle.runs import Prepared, Run
from identification.mismatch.vehicle.screening import whitened
from identification.recording import Floats
from identification.run_history.splines import spline

BUMPS = 6
"""Knots of a free force: as many as the quantiles of a run of minutes determine."""
BACK = 1e-300
"""Smallest p-value that is told: 0 has no logarithm."""


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
        Q = beyond(base, columns)
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


def inconstancies(fitted: Fit, white: Weights, data: Prepared, term: int) -> list[str]:
    """Parts of the recordings in which a term's amount differs by more than chance and VEHICLE_PART_DIFFERENCE."""
    layout, i = fitted.layout, fitted.layout.first_of[term]
    amount = fitted.theta[i] - (layout.parts[term][0].neutral or 0.0)
    if len(layout.parts[term]) > 1 or amount == 0 or not fitted.free[i]:
        return []
    base = orthogonal_basis(fitted.jacobian)
    effects = [
        amount * added_forces(layout, fitted.theta, data, j, fitted.motions[j])[:, i] for j in range(len(data.runs))
    ]
    out = []
    splits = _splits(fitted.motions, data)
    for name, masks in splits.items():
        columns = [
            respond(layout, fitted.theta, data, j, fitted.motions[j], (effects[j] * masks[j])[:, None])[:, :-2]
            for j in range(len(data.runs))
        ]
        column = whitened(white, columns, fitted.residual.size)[:, 0]
        apart = difference(column, base, fitted.residual, policy.vehicle.VEHICLE_PART_DIFFERENCE, len(splits))
        if apart is not None:
            out.append(f"its parameter is not the same {name} ({100 * apart:.0f} % apart)")
    return out


def _splits(motions: Sequence[Motion], data: Prepared) -> dict[str, list[Floats]]:
    """Two parts of all that was recorded, several times."""
    halves = [(np.arange(run.steps) < run.steps // 2).astype(np.float64) for run in data.runs]
    ahead = [(_middle(m.v) > 0).astype(np.float64) for m in motions]
    out = {"in the first and the second half of the runs": halves}
    share = float(np.mean(np.concatenate(ahead)))
    if policy.vehicle.AHEAD_ASTERN_SHARE < share < 1 - policy.vehicle.AHEAD_ASTERN_SHARE:
        out["ahead and astern"] = ahead
    if len(data.runs) > 1:
        out["in every second run"] = [np.full(run.steps, float(j % 2)) for j, run in enumerate(data.runs)]
    return out
