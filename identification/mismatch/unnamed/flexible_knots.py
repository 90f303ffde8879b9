"""The best flexible term over one covariate: what it multiplies, its degree and its knots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.flexible_terms.flexible import Flexible, Multiplier, lately, turned
from identification.mismatch.estimate.estimate import Estimate
from identification.mismatch.estimate.fitting import Fit
from identification.mismatch.locate.pulses import Pulses
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.mismatch.model.whitening import Weights
from identification.mismatch.select.family_wise import orthogonal_basis
from identification.mismatch.select.likeliest_trials import likeliest_jumps
from identification.mismatch.unnamed.flexible_kinds import shapes_over
from identification.mismatch.unnamed.spline_knot_selection import Moments, choose, heights, nodes_of
from identification.recording import Floats
from identification.run_history.splines import spline

JUMPS = 3
"""Instants at which the reading may have jumped; a spline over time may have knots beside them."""


@dataclass(frozen=True, eq=False)
class FlexibleCandidate:
    """One flexible term with its linear estimate."""

    term: Flexible
    start: tuple[float, ...]
    gain: float
    """Of BIC."""


def best_over(quantity: str, estimate: Estimate, data: Data, pulses: Pulses | None = None) -> FlexibleCandidate | None:
    """The best flexible term over a covariate by BIC; None where there is none that could be.

    `pulses` of one run: a spline over time may begin anew with each.
    """
    shapes = shapes_over(quantity, data)
    if quantity == "time" and pulses is not None and len(data.histories) == 1:
        edges = sorted({pulses.begin % pulses.period, (pulses.begin + pulses.length) % pulses.period})
        shapes.append(Flexible("time", "s", tuple(edges), (), ("gain",), period=pulses.period))
    return best_of(shapes, estimate, data)


def best_of(shapes: Sequence[Flexible], estimate: Estimate, data: Data) -> FlexibleCandidate | None:
    """The best of several kinds of flexible term, their knots chosen."""
    found = [chosen for shape in shapes if (chosen := with_knots(shape, estimate, data)) is not None]
    return max(found, key=lambda c: c.gain, default=None)


def with_knots(shape: Flexible, estimate: Estimate, data: Data) -> FlexibleCandidate | None:
    """Knots and degree by BIC, from the whitened residual of the estimate, its own parameters free to follow."""
    over, columns = seen_at(shape, estimate.fit, data)
    if shape.quantity == "time_since_step":
        shape = replace(shape, knots=(min(1.5 * data.scale.interval, *(h.spacing for h in data.histories)),))
    axis = [shape.axis(v) for v in over]
    every = np.concatenate(axis)
    if float(np.ptp(every)) <= 1e-9 * max(float(np.max(np.abs(every))), 1e-12):
        return None
    jumps = _jumps(shape, every, columns, estimate, data)
    through = (0.0,) if every.min() < 0 < every.max() and shape.quantity != "time_since_step" else ()
    nodes = nodes_of(every, (*through, *(t for pair in jumps for t in pair)))
    if nodes.size < 2:
        return None
    moments = _moments(shape, nodes, axis, columns, estimate, data)
    zero = _zero_nodes(shape, nodes, data)
    beside = [tuple(int(np.argmin(np.abs(nodes - t))) for t in pair) for pair in jumps]
    found = choose(moments, zero, begin=[tuple(j for pair in beside for j in pair)] if shape.period else beside)
    if found is None:
        return None
    at = nodes[list(found.knots)]
    at = np.exp(at) if shape.quantity == "time_since_step" else at
    knots = tuple(float(f"{x:.6g}") for x in at)
    zeros = tuple(i for i, k in enumerate(found.knots) if k in zero)
    term = replace(shape, knots=knots, zero=zeros, degree=found.degree)
    start = heights(moments, found.knots, found.degree, [term.free(m) for m in term.times])
    return FlexibleCandidate(term, tuple(map(float, start)), found.gain)


def _jumps(
    shape: Flexible, over: Floats, columns: Sequence[Floats], estimate: Estimate, data: Data
) -> list[tuple[float, float]]:
    """Instants before and after which what a term over time multiplies may have jumped: even knots cannot follow."""
    if shape.quantity != "time":
        return []
    if shape.period:
        return _beside(shape.knots, over)
    basis = orthogonal_basis(estimate.fit.jacobian[: data.size])
    each = ([c[:, k] for c in columns] for k in range(len(shape.times)))
    found = [at for of in each for at in likeliest_jumps(estimate.fit, data, estimate.weights, basis, JUMPS, of)]
    return _beside(found, over)


def _beside(instants: Sequence[float], over: Floats) -> list[tuple[float, float]]:
    """The last row before each instant and the first after it."""
    rows = np.sort(over)
    after = np.unique(np.clip(np.searchsorted(rows, instants), 1, rows.size - 1))
    return [(float(rows[i - 1]), float(rows[i])) for i in after]


def seen_at(shape: Flexible, fitted: Fit, data: Data) -> tuple[list[Floats], list[Floats]]:
    """Per run at its thrust rows: the covariate (n,), and what each multiplier makes of 1 (n, multipliers)."""
    over, columns = [], []
    for run, r, tare in zip(data.runs, data.rows, fitted.theta.tares, strict=True):
        h = run.history
        F, x = predict(fitted.model, fitted.theta, run, data.scale, tare)
        before = h.previous
        made: dict[Multiplier, Floats] = {
            "force": np.ones_like(F),
            "gain": F,
            "even": np.abs(F),
            "step": F - fitted.theta.C * before * np.abs(before),
            "reversed": np.where(turned(h, x, data.scale)[1], F, 0.0),
            "rate": np.abs(x) / data.scale.driver,
            "drive": 2 * fitted.theta.C * np.abs(x),
        }
        if "late" in shape.times:
            made["late"] = lately(F, h.dt, shape.memory)
        over.append(shape.over(run, x, data.scale)[r])
        columns.append(np.column_stack([made[m][r] for m in shape.times]))
    return over, columns


def _moments(
    shape: Flexible, nodes: Floats, axis: Sequence[Floats], columns: Sequence[Floats], estimate: Estimate, data: Data
) -> Moments:
    n = data.size
    raw = []
    for values, times in zip(axis, columns, strict=True):
        hats = spline(values, nodes, np.eye(nodes.size), 1)
        raw.append(np.column_stack([hats * times[:, [j]] for j in range(times.shape[1])]))
    white = Weights(estimate.weights.thrust).whiten(raw, [])
    basis = orthogonal_basis(estimate.fit.jacobian[:n])
    white = white - basis @ (basis.T @ white)
    constant = tuple(not replace(shape, zero=(0,)).zeros(m) for m in shape.times)
    return Moments(nodes, white.T @ white, white.T @ estimate.fit.residual[:n], n, constant)


def _zero_nodes(shape: Flexible, nodes: Floats, data: Data) -> tuple[int, ...]:
    """Nodes at which the spline is nothing by definition: at rest, at zero, at the beginning, long after a step."""
    nearest = int(np.argmin(np.abs(nodes)))
    match shape.quantity:
        case "time" | "direction_of_change":
            return (0,)
        case "direction" | "time_since_step":
            return (nodes.size - 1,)
        case quantity if quantity == data.histories[0].driver_quantity:
            largest = int(np.argmax(np.abs(nodes)))
            return tuple(sorted({nearest, largest})) if shape.times == ("force",) else (largest,)
        case _:
            return (nearest,)
