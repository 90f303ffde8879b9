"""Faults that one channel shows against the driver and the others: rescaled, reversed, unsigned.

Static laws of a thruster: rate and motor voltage follow the driver's sign and nearly its size, thrust, torque and
current nearly its size squared; supply, flow and temperatures do not follow its sign. Each test asks for two
things: that the channel's own law fails, and that the law of the fault holds, over the run's blocks and by far.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from identification.estimation.tails import student_sf
from identification.mismatch import policy
from identification.mismatch.faults.cells import (
    BLOCKS,
    Cells,
    explained,
    fitted,
    gain,
    shapes,
)
from identification.mismatch.value import Value
from identification.recording import Floats

LINEAR = ("rotation_rate", "motor_voltage")
SQUARE = ("thrust", "current", "torque")
FACTORS: Mapping[float, str] = {
    60.0: "per minute for per second",
    2 * np.pi: "rad for turns",
    9.80665: "kilogram-force for newton",
    4.4482216: "pound-force for newton",
    2.2046226: "pound for kilogram",
    1000.0: "a prefix (milli, kilo)",
    100.0: "per cent",
    10.0: "a digit",
    2.0: "a factor of two",
}

LEVEL_NEAR, LAW_LEVELS = 0.05, 6
"""Of the largest driver: values so near one another are one level; and levels that a cubic law asks for."""

Scaled = tuple[str, str, float, dict[str, Value]]


def impossible(cells: Cells) -> Iterator[Scaled]:
    """Units that the size of a channel gives away."""
    rate = cells.values.get("rotation_rate")
    if rate is not None and np.nanmax(np.abs(rate)) > policy.faults.FASTEST_ROTATION:
        says = f"rotation_rate reaches {np.nanmax(np.abs(rate)):.4g} rev/s; these are turns per minute (60)."
        yield "rotation_rate", says, 0.0, {"factor": Value(60.0, 0.0, "1")}
    if cells.driver_quantity != "command_voltage":
        return
    for q in ("motor_voltage", "bus_voltage"):
        y = cells.values.get(q)
        if y is None or not np.isfinite(y).any():
            continue
        if q == "motor_voltage":
            ratio = abs(float(fitted(shapes(cells.driver)["linear"], y)[0][1])) / cells.size
        else:
            ratio = float(np.nanmedian(np.abs(y))) / cells.size
        factor = (
            1000.0
            if ratio > policy.faults.MILLIVOLTS_RATIO
            else 0.001
            if 0 < ratio < policy.faults.KILOVOLTS_RATIO
            else 0.0
        )
        if factor:
            says = f"{q} is {ratio:.3g} times the command: {'milli' if factor > 1 else 'kilo'}volts, not volts."
            yield q, says, 0.0, {"factor": Value(factor, 0.0, "1")}


def named_factor(factor: float) -> tuple[float, str]:
    """The factor of a unit near it and what that is; the factor itself and "" without one."""
    for known, what in FACTORS.items():
        for exact in (known, 1 / known):
            if abs(factor / exact - 1) < policy.faults.UNIT_FACTOR_NEAR:
                return exact, what
    return factor, ""


def _telling(factor: float) -> bool:
    if not factor > 0:
        return False
    size = max(factor, 1 / factor)
    return size > policy.faults.SCALE_FACTOR or (
        size > policy.faults.NAMED_SCALE_FACTOR and bool(named_factor(factor)[1])
    )


def midway(cells: Cells) -> Iterator[Scaled]:
    """Channels whose scale changes at once within the run, alone of all."""
    found = {q: _change(cells, cells.values[q]) for q in (*LINEAR, *SQUARE) if q in cells.values}
    for q, change in found.items():
        if change is None:
            continue
        start, factor, std, p = change
        if any(o is not None and o[0] == start and k != q for k, o in found.items()):
            continue  # several at once: the rotor did it
        _, what = named_factor(factor)
        says = f"{q} changes its scale {factor:.4g}-fold at {start:.4g} s, alone of all"
        says += f" ({what})." if what else "."
        yield q, says, p, {"factor": Value(factor, std, "1"), "start": Value(start, 0.0, "s")}


def _change(cells: Cells, y: Floats) -> tuple[float, float, float, float] | None:
    """(time, factor, its standard error, p) of the likeliest change of scale; None without a telling one."""
    good = np.flatnonzero(np.isfinite(y))
    if good.size < 4 * BLOCKS:
        return None
    columns = shapes(cells.driver)["odd"]
    X, v = columns[good], y[good]
    at = _split(X, v)
    if at is None:
        return None
    before, after = (
        slice(0, at - policy.faults.SCALE_CHANGE_CELLS),
        slice(at + policy.faults.SCALE_CHANGE_CELLS, good.size),
    )
    if min(explained(X[before], v[before]), explained(X[after], v[after])) < policy.faults.FOLLOWS_LAW:
        return None
    if np.unique(np.round(cells.driver[good][before] / LEVEL_NEAR)).size < LAW_LEVELS:
        return None
    inner = np.abs(cells.driver[good]) <= np.max(np.abs(cells.driver[good][before])) + 0.02
    law = X @ np.linalg.lstsq(X[before], v[before], rcond=None)[0]
    late = np.flatnonzero(inner & (np.arange(good.size) >= at + policy.faults.SCALE_CHANGE_CELLS))
    if late.size < BLOCKS or not np.any(law[late]):
        return None
    blocks = [b for b in np.array_split(late, 8) if np.ptp(law[b]) > 0.05 * np.ptp(law)]
    factors = np.array([np.polyfit(law[b], v[b], 1)[0] for b in blocks])
    if factors.size < 4 or np.any(factors <= 0):
        return None
    logs = np.log(factors)
    middle, spread = float(np.median(logs)), float(np.std(logs, ddof=1))
    if not _telling(float(np.exp(middle))) or spread > policy.faults.SCALE_SCATTER * abs(middle):
        return None
    error = spread / np.sqrt(logs.size)
    p = float(2 * student_sf(abs(middle) / max(error, 1e-12), logs.size - 1))
    return float(cells.time[good[at]]), float(np.exp(middle)), float(np.exp(middle) * error), p


def _split(X: Floats, v: Floats) -> int | None:
    """Row at which two separate fits leave least."""
    grams = np.cumsum(X[:, :, None] * X[:, None, :], axis=0)
    moments = np.cumsum(X * v[:, None], axis=0)
    n = v.size
    edge = max(n // 12, 3 * X.shape[1])
    tried = np.unique(np.linspace(edge, n - edge, 400).astype(int))
    best, place = -np.inf, None
    tiny = 1e-9 * np.eye(X.shape[1]) * np.trace(grams[-1])
    for i in tried.tolist():
        A, b = grams[i - 1], moments[i - 1]
        A2, b2 = grams[-1] - A, moments[-1] - b
        score = float(b @ np.linalg.solve(A + tiny, b) + b2 @ np.linalg.solve(A2 + tiny, b2))
        if score > best:
            best, place = score, i
    if place is None:
        return None
    step = int(np.max(np.diff(tried), initial=1))
    near = range(max(place - step, edge), min(place + step, n - edge) + 1)
    scores = [_score(grams, moments, i, tiny) for i in near]
    return near[int(np.argmax(scores))]


def _score(grams: Floats, moments: Floats, i: int, tiny: Floats) -> float:
    A, b = grams[i - 1], moments[i - 1]
    A2, b2 = grams[-1] - A, moments[-1] - b
    return float(b @ np.linalg.solve(A + tiny, b) + b2 @ np.linalg.solve(A2 + tiny, b2))


def unsigned(cells: Cells) -> Iterator[tuple[str, str, float]]:
    """Channels that lost their sign: on both sides of the driver they go the same way."""
    if not cells.both_ways:
        return
    for q in ("thrust", "rotation_rate", "current", "torque"):
        y = cells.values.get(q)
        if y is None or np.count_nonzero(np.isfinite(y)) < BLOCKS:
            continue
        columns = shapes(cells.driver)["linear_sides" if q in LINEAR else "sides"]
        right, _, p_right = gain(cells, columns, y, 1)
        left, _, p_left = gain(cells, columns, y, 2)
        if right * left >= 0 or min(abs(right), abs(left)) < policy.faults.UNSIGNED_SLOPES * max(abs(right), abs(left)):
            continue
        if explained(shapes(cells.driver)["even"], y) < policy.faults.EVEN_LAW or q == "torque":
            continue
        says = (
            f"{q} has no sign: it goes {'up' if right > 0 else 'down'} whichever way the {cells.driver_quantity} goes."
        )
        yield q, says, max(p_right, p_left)


def reversed_channels(cells: Cells, done: set[str]) -> Iterator[Scaled]:
    """Channels of the wrong sign against the driver; all of them: the driver itself."""
    x = shapes(cells.driver)
    slopes: dict[str, tuple[float, float, float]] = {}
    for q in ("thrust", "rotation_rate", "motor_voltage", "current"):
        y = cells.values.get(q)
        if (
            y is None
            or q in done
            or np.count_nonzero(np.isfinite(y)) < policy.faults.CHANNEL_CELLS
            or explained(x["odd"], y) < policy.faults.ODD_LAW
        ):
            continue
        slopes[q] = gain(cells, x["linear" if q in LINEAR else "quadratic"], y, 1)
    wrong = {q: s for q, s in slopes.items() if s[0] < 0}
    if len(wrong) > 1 and len(wrong) == len(slopes):
        says = f"{', '.join(wrong)} all go against the {cells.driver_quantity}: its sign is reversed."
        yield cells.driver_quantity, says, max(s[2] for s in wrong.values()), {}
        return
    for q, (slope, error, p) in wrong.items():
        says = f"{q} goes against the {cells.driver_quantity}: its sign is reversed"
        says += "." if len(slopes) > 1 else ", or that of the driver: no other channel tells which."
        yield q, says, p, {"slope": Value(slope, error, "1")}
