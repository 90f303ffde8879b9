"""What a residual may be looked at over: each thing that was recorded, and columns of any shape over it.

The columns are hat functions (a spline of order one), plain and times the force, so that a change of zero and a change
of gain are both seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identification.flexible_terms.flexible import turned
from identification.mismatch import policy
from identification.mismatch.estimate.fitting import Fit, raw
from identification.mismatch.model.data import Data
from identification.mismatch.model.predictor import predict
from identification.recording import Floats
from identification.run_history.filters import delayed, lowpass
from identification.run_history.slip import slip

MOST_HATS = 17
"""Hats over one covariate, at most: a shape with more would be noise."""
FEW_ROWS = 60
"""Static tables with fewer rows have fewer hats."""
LOADS = (5.0, 20.0, 60.0, 200.0)
"""s, memories of long loads."""
FOLLOWED = (
    ("flow_speed", "m/s"),
    ("bus_voltage", "V"),
    ("motor_temperature", "degC"),
    ("water_temperature", "degC"),
    ("neighbour_thrust", "N"),
)


@dataclass(frozen=True, eq=False)
class Covariate:
    """One covariate at the rows of each run, and the columns of any shape over it."""

    quantity: str
    values: tuple[Floats, ...]
    """Per run (n,), in `unit`; what a person reads."""
    unit: str
    columns: tuple[Floats, ...]
    """Per run (n, p)."""
    what: str
    """What a residual over it means, as a clause."""


@dataclass(frozen=True, eq=False)
class _View:
    """What the covariates are made of, run by run at the thrust rows; force and rate in units of their scales."""

    fit: Fit
    data: Data
    force: tuple[Floats, ...]
    rate: tuple[Floats, ...]
    driver: tuple[Floats, ...]
    previous: tuple[Floats, ...]
    whole: tuple[tuple[Floats, Floats], ...]
    """(force, rate) on all intervals, in N and in units of the driver."""

    def of(self, quantity: str) -> tuple[Floats, ...]:
        return tuple(h.others[quantity][r] for h, r in zip(self.data.histories, self.data.rows, strict=True))


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


def covariates(fit: Fit, data: Data) -> tuple[Covariate, ...]:
    """All that can be looked at in these runs."""
    every = zip(data.runs, fit.theta.tares, strict=True)
    whole = tuple(predict(fit.model, fit.theta, run, data.scale, tare) for run, tare in every)
    # with the nuisances, or their slope would be a part of every gain
    thrust, _ = raw(fit.model, fit.theta, data, with_rate=False)
    view = _View(
        fit,
        data,
        tuple((F - tare) / data.scale.thrust for F, tare in zip(thrust, fit.theta.tares, strict=True)),
        tuple(x[r] / data.scale.driver for (_, x), r in zip(whole, data.rows, strict=True)),
        tuple(h.driver[r] for h, r in zip(data.histories, data.rows, strict=True)),
        tuple(h.previous[r] for h, r in zip(data.histories, data.rows, strict=True)),
        whole,
    )
    if any(h.static for h in data.histories):
        return (*_levels(view), *_recorded(view))
    return (*_levels(view), *_times(view), *_memories(view), *_channels(view))


def _splines(
    quantity: str, unit: str, over: Sequence[Floats], knots: Floats, gains: Sequence[Sequence[Floats]], what: str
) -> Covariate:
    """Hats over the covariate, plain and times each gain."""
    columns = []
    for i, value in enumerate(over):
        basis = hats(value, knots)
        columns.append(np.column_stack([basis, *(basis * g[i][:, None] for g in gains)]))
    return Covariate(quantity, tuple(over), unit, tuple(columns), what)


WAKE = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
"""s since it turned the other way."""
LATE = (1.0, 10.0, 100.0)
"""Intervals of the finest kind."""


def _levels(view: _View) -> Iterator[Covariate]:
    data, V = view.data, view.driver
    most = MOST_HATS if data.size >= FEW_ROWS else max(3, data.size // 4)
    quantity = data.histories[0].driver_quantity
    yield _splines(quantity, data.scale.driver_unit, V, _knots(V, most), (), "the static curve has another shape")
    least = policy.select.DIRECTION_DRIVER * data.scale.driver
    sides = [np.column_stack([v > least, v < -least]).astype(np.float64) for v in V]
    columns = tuple(np.column_stack([s, s * f[:, None]]) for s, f in zip(sides, view.force, strict=True))
    yield Covariate("direction", tuple(np.sign(v) for v in V), "1", columns, "the two directions differ")


def _times(view: _View) -> Iterator[Covariate]:
    data = view.data
    t = [h.middle[r] for h, r in zip(data.histories, data.rows, strict=True)]
    knots = np.linspace(0, max(float(h.edges[-1]) for h in data.histories), 11)
    yield _splines("time", "s", t, knots, (view.force,), "zero or gain change in the course of the run")
    since = tuple(h.since_step[r] for h, r in zip(data.histories, data.rows, strict=True))
    knots = np.geomspace(max(1.5 * data.scale.interval, 0.02), max(3.0, 4 * data.scale.interval), 7)
    at_once = min(h.spacing for h in data.histories)
    knots = np.concatenate([[at_once], knots]) if at_once < 0.5 * knots[0] else knots
    columns = []
    for i, (s, f, before) in enumerate(zip(since, view.force, view.previous, strict=True)):
        basis = hats(np.log(np.maximum(s, knots[0])), np.log(knots))
        jump = f - before * np.abs(before) / data.scale.driver**2
        steps = (basis * kind[:, None] for kind in (jump, f))
        columns.append(np.column_stack([*steps, _turned(view, i), *_late(view, i)]))
    yield Covariate("time_since_step", since, "s", tuple(columns), "it follows a step late, or overshoots")


def _turned(view: _View, run: int) -> Floats:
    """(n, p) hats over the time since it turned the other way, times the force: a sine turns without a step."""
    history, rows = view.data.histories[run], view.data.rows[run]
    age, known = turned(history, view.whole[run][1], view.data.scale)
    basis = hats(np.log(np.maximum(age[rows], WAKE[0])), np.log(np.array(WAKE)))
    return basis * np.where(known[rows], view.force[run], 0.0)[:, None]


def _late(view: _View, run: int) -> Iterator[Floats]:
    """(n,) each: what the force would be a little later, less what it is: on ramps and sines nothing is a step."""
    history, rows = view.data.histories[run], view.data.rows[run]
    force = view.whole[run][0] / view.data.scale.thrust
    for delay in LATE:
        if delay * view.data.scale.interval < 0.1 * view.data.scale.duration:
            yield (delayed(force, history.edges, delay * view.data.scale.interval) - force)[rows]


def _memories(view: _View) -> Iterator[Covariate]:
    data = view.data
    unit = data.scale.driver_unit
    knots = _knots(view.previous, 9)
    yield _splines("previous_voltage", unit, view.previous, knots, (view.force,), "it remembers the level before")
    up = tuple(h.direction_of_change[r] for h, r in zip(data.histories, data.rows, strict=True))
    columns = tuple(
        u[:, None] * np.column_stack([np.ones_like(f), np.abs(x), np.abs(f), f])
        for u, f, x in zip(up, view.force, view.rate, strict=True)
    )
    yield Covariate("direction_of_change", up, "1", columns, "up and down differ")
    loads = tuple(_loads(view, i) for i in range(len(data.histories)))
    yield Covariate("load_history", tuple(np.abs(f) for f in view.force), "1", loads, "it remembers long loads")


def _loads(view: _View, run: int) -> Floats:
    """(n, p) low-passes of |force|, force and copper loss, plain and times the force."""
    scale, (force, rate) = view.data.scale, view.whole[run]
    rows, dt = view.data.rows[run], view.data.histories[run].dt
    columns = []
    for tau in LOADS:
        if tau < 0.5 * scale.duration:
            for load in (np.abs(force) / scale.thrust, force / scale.thrust, (rate / scale.driver) ** 4):
                slow = lowpass(load, dt, tau)[1][rows]
                columns += [slow, slow * view.force[run]]
    return np.column_stack(columns) if columns else np.empty((rows.size, 0))


def _recorded(view: _View) -> Iterator[Covariate]:
    """What was recorded beside the driver and is no answer to it."""
    data = view.data
    size = tuple(np.abs(x) for x in view.rate)
    for quantity, unit in FOLLOWED:
        if all(quantity in h.others for h in data.histories):
            value = view.of(quantity)
            every = np.concatenate(value)
            if float(np.ptp(every)) > 1e-9 * max(float(np.max(np.abs(every))), 1e-12):
                gains = (view.force, size)
                yield _splines(quantity, unit, value, _knots(value, 6), gains, f"it follows {quantity}")


def _channels(view: _View) -> Iterator[Covariate]:
    yield from _recorded(view)
    data, size = view.data, tuple(np.abs(x) for x in view.rate)
    if data.scale.torque > 0 and all("torque" in h.others for h in data.histories):
        yield _torque(view)
    if all(h.rate is not None for h in data.histories):
        columns = []
        for run, r, (_, x), rate, s in zip(data.runs, data.rows, view.whole, view.rate, size, strict=True):
            gap = slip(run, x, view.fit.theta.k or 1.0)[r] / data.scale.driver
            columns.append(np.column_stack([gap, gap * s, gap * rate]))
        what = "thrust follows the measured rate where it leaves the command"
        yield Covariate("rotation_rate", view.of("rotation_rate"), "rev/s", tuple(columns), what)


def _torque(view: _View) -> Covariate:
    """Beyond what the driver makes of it: a torque is a response as the thrust is, and has the same static curves."""
    torque, knots = view.of("torque"), _knots(view.driver, MOST_HATS)
    curve = [hats(v, knots) for v in view.driver]
    law = np.linalg.lstsq(np.concatenate(curve), np.concatenate(torque), rcond=None)[0]
    columns = []
    for q, known, rate in zip(torque, curve, view.rate, strict=True):
        gap = (q - known @ law) / view.data.scale.torque
        columns.append(np.column_stack([gap, gap * np.abs(rate), gap * rate]))
    what = "thrust follows the measured torque where it leaves the command"
    return Covariate("torque", torque, "N.m", tuple(columns), what)
