"""What no term carries: structure of any shape in what is left, over each thing that was recorded.

Each coordinate has a group of columns, hat functions over it (a spline of order one), plain and times the force. The
size of the whitened residual in the span of a group is chi-square distributed when nothing is left. The smallest
p-value of all groups is judged against its own distribution under drawn signs of blocks, as the screening is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi2_law
from scipy.stats import ncx2

from identification.mismatch.fitting import Fit
from identification.mismatch.model import Data, Weights, predict
from identification.mismatch.screening import orthogonal_basis, quiet, surrogate_scores
from identification.physics.filters import lowpass
from identification.physics.history import History
from identification.physics.rotation_coupling import slip as measured_slip
from identification.recording import Floats

SHAPE_ERROR = 0.03
"""A textbook shape is trusted to this share of its own correction."""
LOADS = (5.0, 20.0, 60.0, 200.0)
"""s, memories of long loads."""
FEW_ROWS = 60
"""Static tables with fewer rows have fewer hats."""


@dataclass(frozen=True, eq=False)
class Coordinate:
    """One covariate at the rows of each run, and the columns of any shape over it."""

    quantity: str
    covariate: tuple[Floats, ...]
    """Per run (n,), in `unit`; what a person reads."""
    unit: str
    columns: tuple[Floats, ...]
    """Per run (n, p)."""
    what: str
    """What a residual over it means, as a clause."""


@dataclass(frozen=True, eq=False)
class Judged:
    """One coordinate's group of columns against the residual."""

    coordinate: Coordinate
    statistic: float
    dof: int
    p_value: float
    """Of this group alone, shape error of the model's terms allowed for."""
    share: float
    """Of the residual's (whitened) sum of squares beyond what noise has."""


@dataclass(frozen=True, eq=False)
class Omnibus:
    groups: tuple[Judged, ...]
    """Smallest p-value first."""
    p_value: float
    """Family-wise, of the smallest."""


def hats(value: Floats, knots: Floats) -> Floats:
    """(n, k) hat functions; their sum is 1 everywhere, the outer ones are constant outside."""
    out = np.zeros((value.size, knots.size))
    if knots.size == 1:
        out[:] = 1.0
        return out
    inside = np.clip(value, knots[0], knots[-1])
    j = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, knots.size - 2)
    w = (inside - knots[j]) / (knots[j + 1] - knots[j])
    at = np.arange(value.size)
    out[at, j] = 1 - w
    out[at, j + 1] += w
    return out


def _knots(values: Sequence[Floats], most: int) -> Floats:
    """Distinct levels where there are few, otherwise quantiles."""
    every = np.concatenate(values)
    size = float(np.max(np.abs(every))) or 1.0
    levels = np.unique(np.round(every / size, 3)) * size
    weight = (
        np.array([np.count_nonzero(np.abs(every - v) <= 6e-4 * size) for v in levels])
        if levels.size <= 400
        else np.empty(0)
    )
    if weight.size:
        main = levels[weight >= max(3, 0.002 * every.size)]
        if 2 <= main.size <= most and weight[weight >= max(3, 0.002 * every.size)].sum() > 0.6 * every.size:
            return main
    found: Floats = np.unique(np.quantile(every, np.linspace(0, 1, most)))
    keep = np.concatenate([[True], np.diff(found) > 1e-6 * size])
    out: Floats = found[keep]
    return out


def coordinates(fit: Fit, data: Data) -> tuple[Coordinate, ...]:
    """All that can be looked at in these runs."""
    parts = [predict(fit.model, fit.theta, h, data.scale, i) for i, h in enumerate(data.histories)]
    F = [p[0][r] / data.scale.thrust for p, r in zip(parts, data.rows, strict=True)]
    x = [p[1][r] / data.scale.driver for p, r in zip(parts, data.rows, strict=True)]
    hs, rows = data.histories, data.rows
    static = any(h.static for h in hs)
    most = 17 if data.size >= FEW_ROWS else max(3, data.size // 4)

    def each(get: Callable[[History], Floats]) -> list[Floats]:
        return [get(h)[r] for h, r in zip(hs, rows, strict=True)]

    out: list[Coordinate] = []

    def add(
        quantity: str,
        unit: str,
        covariate: Sequence[Floats],
        basis: Sequence[Floats],
        gains: Sequence[Sequence[Floats]],
        what: str,
    ) -> None:
        columns = tuple(
            np.column_stack([b] + [b * g[i][:, None] for g in gains]) if gains is not None else b
            for i, b in enumerate(basis)
        )
        out.append(Coordinate(quantity, tuple(covariate), unit, columns, what))

    V = each(lambda h: h.driver)
    knots = _knots(V, most)
    driver = hs[0].driver_quantity
    add(driver, data.scale.driver_unit, V, [hats(v, knots) for v in V], (), "the static curve has another shape")
    turning = [
        np.column_stack([(v > 0.02 * data.scale.driver), (v < -0.02 * data.scale.driver)]).astype(np.float64) for v in V
    ]
    add("direction", "1", [np.sign(v) for v in V], turning, (F,), "the two directions differ")
    if static:
        return tuple(out)
    end = max(float(h.edges[-1]) for h in hs)
    t = each(lambda h: h.middle)
    time_knots = np.linspace(0, end, 11)
    add("time", "s", t, [hats(v, time_knots) for v in t], (F,), "zero or gain change in the course of the run")
    since = each(lambda h: h.since_step)
    scale_knots = np.geomspace(max(1.5 * data.scale.interval, 0.02), max(3.0, 4 * data.scale.interval), 7)
    before = each(lambda h: h.previous)
    jump = [f - b * np.abs(b) / data.scale.driver**2 for f, b in zip(F, before, strict=True)]
    basis = [hats(np.log(np.maximum(s, scale_knots[0])), np.log(scale_knots)) for s in since]
    add(
        "time_since_step",
        "s",
        since,
        [b * j[:, None] for b, j in zip(basis, jump, strict=True)],
        (),
        "it follows a step late, or overshoots",
    )
    out[-1] = Coordinate(
        "time_since_step",
        tuple(since),
        "s",
        tuple(np.column_stack([c, b * f[:, None]]) for c, b, f in zip(out[-1].columns, basis, F, strict=True)),
        out[-1].what,
    )
    prev_knots = _knots(before, 9)
    add(
        "previous_voltage",
        data.scale.driver_unit,
        before,
        [hats(b, prev_knots) for b in before],
        (F,),
        "it remembers the level before",
    )
    up = [np.sign(v - b) for v, b in zip(V, before, strict=True)]
    out.append(
        Coordinate(
            "direction_of_change",
            tuple(up),
            "1",
            tuple(np.column_stack([u, u * np.abs(f), u * f]) for u, f in zip(up, F, strict=True)),
            "up- and down-steps differ",
        )
    )
    memory = []
    for h, r, (force, rate), f in zip(hs, rows, parts, F, strict=True):
        cols = []
        for tau in LOADS:
            if tau < 0.5 * data.scale.duration:
                for u in (
                    np.abs(force) / data.scale.thrust,
                    force / data.scale.thrust,
                    (rate / data.scale.driver) ** 4,
                ):
                    m = lowpass(u, h.dt, tau)[1][r]
                    cols += [m, m * f]
        memory.append(np.column_stack(cols) if cols else np.empty((r.size, 0)))
    out.append(Coordinate("load_history", tuple(np.abs(f) for f in F), "1", tuple(memory), "it remembers long loads"))
    for quantity, unit in (
        ("flow_speed", "m/s"),
        ("bus_voltage", "V"),
        ("motor_temperature", "degC"),
        ("water_temperature", "degC"),
        ("neighbour_thrust", "N"),
        ("torque", "N.m"),
    ):
        if all(quantity in h.others for h in hs):
            value = each(lambda h, q=quantity: h.others[q])  # type: ignore[misc]  # bound now
            if float(np.ptp(np.concatenate(value))) <= 1e-9 * max(float(np.max(np.abs(np.concatenate(value)))), 1e-12):
                continue
            k = _knots(value, 6)
            add(
                quantity,
                unit,
                value,
                [hats(v, k) for v in value],
                (F, [np.abs(a) for a in x]),
                f"it follows {quantity}",
            )
    if all(h.rate is not None for h in hs):
        slip = []
        for h, r, (_, rate) in zip(hs, rows, parts, strict=True):
            gap = measured_slip(h, rate, fit.theta.k or 1.0)[r] / data.scale.driver
            slip.append(gap)
        out.append(
            Coordinate(
                "rotation_rate",
                tuple(each(lambda h: h.others["rotation_rate"])),
                "rev/s",
                tuple(np.column_stack([g, g * np.abs(a), g * a]) for g, a in zip(slip, x, strict=True)),
                "thrust follows the measured rate where it leaves the command",
            )
        )
    return tuple(out)


def test(
    fit: Fit, data: Data, weights: Weights, rng: np.random.Generator, looked_at: Sequence[Coordinate] | None = None
) -> Omnibus:
    """Judge the residual of the thrust over every coordinate."""
    found = tuple(looked_at) if looked_at is not None else coordinates(fit, data)
    n = data.size
    basis = orthogonal_basis(fit.jacobian[:n]) if not weights.rate else _thrust_basis(fit, n)
    residual = fit.residual[:n]
    noise2 = 1.0
    allowed = _allowance(fit, data, weights, n)
    groups, spans = [], []
    for c in found:
        columns = Weights(weights.thrust).whiten(list(c.columns), [])
        columns = columns - basis @ (basis.T @ columns)
        Q = orthogonal_basis(columns)
        if Q.shape[1] == 0:
            continue
        score = Q.T @ residual
        stat, dof = float(score @ score) / noise2, Q.shape[1]
        extra = float(sum(np.sum((Q.T @ a) ** 2) for a in allowed))
        p = _tail(stat, dof, extra)
        groups.append(Judged(c, stat, dof, p, max(stat - dof, 0.0) / max(float(residual @ residual), 1e-300)))
        spans.append(Q)
    order = np.argsort([g.p_value for g in groups])
    if not groups:
        return Omnibus((), 1.0)
    clean = quiet(residual, np.column_stack(spans))
    ends = np.cumsum([Q.shape[1] for Q in spans])[:-1]
    scores = np.split(surrogate_scores(np.column_stack(spans), clean, rng) ** 2, ends, axis=1)
    nulls = [chi2_law.sf(s.sum(axis=1), s.shape[1]) for s in scores]
    smallest = np.min(np.array(nulls), axis=0)
    least = groups[order[0]].p_value
    # scaled so that the family behaves as its draws do: heavy tails and colour within a block are in them
    at = float(np.quantile(smallest, 0.05))
    p_family = (1 + np.count_nonzero(smallest <= least)) / (1 + smallest.size)
    if p_family < 20 / smallest.size:
        factor = max(0.05 / max(at, 1e-300), float(len(groups)))
        p_family = min(p_family, factor * least)
    return Omnibus(tuple(groups[i] for i in order), float(max(min(p_family, 1.0), min(1.0, least))))


def _thrust_basis(fit: Fit, n: int) -> Floats:
    return orthogonal_basis(fit.jacobian[:n])


def _tail(stat: float, dof: int, extra: float) -> float:
    p = float(ncx2.sf(stat, dof, extra)) if extra > 1e-9 else float(chi2_law.sf(stat, dof))
    return p if np.isfinite(p) else 0.0


def _allowance(fit: Fit, data: Data, weights: Weights, n: int) -> list[Floats]:
    """Whitened (n,) SHAPE_ERROR of what each term changes."""
    out = []
    for term in fit.model.terms:
        smaller = fit.model.without(term)
        values = dict(zip(fit.model.terms, fit.theta.terms, strict=True))
        from dataclasses import replace

        theta = replace(fit.theta, terms=tuple(values[t] for t in smaller.terms))
        change = []
        for i, (h, r) in enumerate(zip(data.histories, data.rows, strict=True)):
            with_it, _ = predict(fit.model, fit.theta, h, data.scale, i)
            without, _ = predict(smaller, theta, h, data.scale, i)
            change.append((with_it - without)[r])
        moved = Weights(weights.thrust).whiten(change, [])
        basis = orthogonal_basis(fit.jacobian[:n])
        out.append(SHAPE_ERROR * (moved - basis @ (basis.T @ moved)))
    return out


@dataclass(frozen=True, slots=True)
class Place:
    """Where over a coordinate the residual is, and its shape."""

    quantity: str
    unit: str
    low: float
    high: float
    share: float
    p_value: float
    table: tuple[tuple[float, float, float], ...]
    """(covariate, mean residual in N, its standard error) bin by bin."""
    what: str


def locate(judged: Judged, fit: Fit, data: Data, noise_inflation: float = 1.0) -> Place:
    """The stretch of the coordinate that holds most of it."""
    c = judged.coordinate
    covariate = np.concatenate(c.covariate)
    n = data.size
    residual = np.concatenate(
        [
            h.thrust[r] - predict(fit.model, fit.theta, h, data.scale, i)[0][r] - fit.theta.tares[i]
            for i, (h, r) in enumerate(zip(data.histories, data.rows, strict=True))
        ]
    )
    count = np.concatenate([h.count[r] for h, r in zip(data.histories, data.rows, strict=True)]).astype(np.float64)
    del n
    edges = _bins(covariate)
    index = np.clip(np.searchsorted(edges, covariate, side="right") - 1, 0, edges.size - 2)
    k = edges.size - 1
    weight = np.bincount(index, weights=count, minlength=k)
    mean = np.bincount(index, weights=count * residual, minlength=k) / np.maximum(weight, 1e-300)
    rows = np.bincount(index, minlength=k)
    spread = np.bincount(index, weights=count * (residual - mean[index]) ** 2, minlength=k) / np.maximum(weight, 1e-300)
    error = noise_inflation * np.sqrt(spread / np.maximum(rows, 1))
    power = np.bincount(index, weights=count * residual**2, minlength=k)
    full = rows > 0
    low, high, share = _stretch(edges, np.asarray(power, dtype=np.float64))
    center = 0.5 * (edges[1:] + edges[:-1])
    table = tuple((float(center[i]), float(mean[i]), float(error[i])) for i in np.flatnonzero(full))
    return Place(c.quantity, c.unit, low, high, share, judged.p_value, table, c.what)


def _bins(covariate: Floats) -> Floats:
    """About 16 bins: levels where there are few, otherwise of equal numbers."""
    levels = np.unique(np.round(covariate, 9))
    if levels.size <= 24:
        if levels.size == 1:
            return np.array([levels[0] - 0.5, levels[0] + 0.5])
        middle = 0.5 * (levels[1:] + levels[:-1])
        return np.concatenate([[levels[0] - (middle[0] - levels[0])], middle, [levels[-1] + (levels[-1] - middle[-1])]])
    found = np.unique(np.quantile(covariate, np.linspace(0, 1, 17)))
    found[-1] = np.nextafter(found[-1], np.inf)
    return found


def _stretch(edges: Floats, power: Floats) -> tuple[float, float, float]:
    """The shortest run of bins that holds 70 % of the power, or the whole."""
    total = float(power.sum())
    if total <= 0:
        return float(edges[0]), float(edges[-1]), 0.0
    best = (0, power.size)
    cumulative = np.concatenate([[0.0], np.cumsum(power)])
    for i in range(power.size):
        j = int(np.searchsorted(cumulative, cumulative[i] + 0.7 * total))
        if j <= power.size and edges[j] - edges[i] < edges[best[1]] - edges[best[0]]:
            best = (i, j)
    share = float((cumulative[best[1]] - cumulative[best[0]]) / total)
    return float(edges[best[0]]), float(edges[best[1]]), share
