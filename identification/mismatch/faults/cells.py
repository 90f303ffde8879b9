"""What every channel did against the driver: means of all channels over the same cells of time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.estimation.tails import student_sf
from identification.mismatch import policy
from identification.recording import Channel, Floats, Recording

DRIVERS = ("command_voltage", "motor_voltage", "rotation_rate")
MOST_CELLS = 1500
"""Cells of one run: enough for any plan's levels, and a change of scale within a run is looked for at each."""
BLOCKS = 16
"""Stretches of a run over which a figure must hold: noise is correlated within them, hardly between them."""


@dataclass(frozen=True, eq=False)
class Cells:
    """One run. All arrays (M,), NaN where a channel has nothing."""

    recording: Recording
    driver_quantity: str
    time: Floats
    driver: Floats
    """Over its largest size: -1 to 1."""
    size: float
    """The largest |driver|."""
    values: Mapping[str, Floats]
    """quantity -> mean in each cell, of channels with at least CHANNEL_CELLS of them."""

    @property
    def block(self) -> NDArray[np.intp]:
        """(M,) of int: to which of BLOCKS stretches a cell belongs."""
        return np.arange(self.time.size) * BLOCKS // self.time.size

    @property
    def both_ways(self) -> bool:
        x = self.driver
        least = min(np.count_nonzero(x > policy.faults.DRIVEN_LEVEL), np.count_nonzero(x < -policy.faults.DRIVEN_LEVEL))
        return bool(least >= max(3, policy.faults.BOTH_WAYS_SHARE * x.size))


def own(recording: Recording, quantity: str) -> Channel | None:
    """The channel of that quantity that belongs to the thruster under test."""
    found = [c for c in recording.all_of(quantity) if c.thruster in (None, "", recording.thruster)]
    primary = [c for c in found if c.calibration.get("role") == "primary"]
    return next(iter(primary or found), None)


def cells_of(recording: Recording, skip: Mapping[str, tuple[float, float]] | None = None) -> Cells | None:
    """Cells of one run, None where nothing drives. `skip`: quantity -> stretch (s) that is left out of it."""
    driver = next((c for q in DRIVERS if (c := own(recording, q)) is not None and _moves(c)), None)
    thrust = own(recording, "thrust")
    if driver is None:
        return None
    clock = (
        thrust
        if thrust is not None and np.count_nonzero(np.isfinite(thrust.value)) >= policy.faults.CHANNEL_CELLS
        else driver
    )
    edges = _edges(clock, driver)
    if edges.size <= policy.faults.CHANNEL_CELLS:
        return None
    quantity = str(driver.quantity)
    x = held_mean(driver, edges) if quantity == "command_voltage" else means(driver, edges, None)
    x = np.nan_to_num(x)
    size = float(np.max(np.abs(x)))
    if not size > 0:
        return None
    values = {}
    for q in dict.fromkeys(c.quantity for c in recording.channels if c.quantity):
        channel = own(recording, q)
        if channel is not None and channel is not driver:
            mean = means(channel, edges, (skip or {}).get(q))
            if np.count_nonzero(np.isfinite(mean)) >= policy.faults.CHANNEL_CELLS:
                values[q] = mean
    return Cells(recording, quantity, 0.5 * (edges[1:] + edges[:-1]), x / size, size, values)


def _moves(channel: Channel) -> bool:
    value = channel.value[np.isfinite(channel.value)]
    return bool(value.size) and float(np.ptp(value)) > 1e-9 * float(np.max(np.abs(value)))


def _edges(clock: Channel, driver: Channel) -> Floats:
    """At most MOST_CELLS cells, of one sample at least, from the first row of the driver to the last of the clock."""
    t = np.unique(clock.time[np.isfinite(clock.value)])
    t = t[t >= driver.time[0] - 1e-9]
    if t.size < policy.faults.CHANNEL_CELLS:
        return np.empty(0)
    if t.size <= MOST_CELLS:
        between = 0.5 * (t[1:] + t[:-1])
        return np.concatenate([[t[0] - 0.5 * (t[1] - t[0])], between, [t[-1] + 0.5 * (t[-1] - t[-2])]])
    return np.linspace(t[0], t[-1] + 1e-9, MOST_CELLS + 1)


def held_mean(channel: Channel, edges: Floats) -> Floats:
    """Mean of a command over each cell; 0 before its first row."""
    good = np.isfinite(channel.value)
    time, value = channel.time[good], channel.value[good]
    knots = np.append(time, max(time[-1], edges[-1]) + 1.0)
    area = np.concatenate([[0.0], np.cumsum(value * np.diff(knots))])
    out: Floats = np.diff(np.interp(edges, knots, area)) / np.diff(edges)
    return out


def means(channel: Channel, edges: Floats, skip: tuple[float, float] | None) -> Floats:
    """Mean of the samples in each cell; a slow channel is interpolated into cells without any."""
    good = np.isfinite(channel.value)
    if skip is not None:
        good &= (channel.time < skip[0]) | (channel.time >= skip[1])
    time, value = channel.time[good], channel.value[good]
    M = edges.size - 1
    if not time.size:
        return np.full(M, np.nan)
    index = np.searchsorted(edges, time, side="right") - 1
    inside = (index >= 0) & (index < M)
    count = np.bincount(index[inside], minlength=M)
    total = np.bincount(index[inside], weights=value[inside], minlength=M)
    middle = 0.5 * (edges[1:] + edges[:-1])
    between = np.interp(middle, time, value, left=np.nan, right=np.nan)
    if skip is not None:
        between[(middle >= skip[0]) & (middle < skip[1])] = np.nan
    out: Floats = np.where(count > 0, total / np.maximum(count, 1), between)
    return out


def shapes(x: Floats) -> dict[str, Floats]:
    """Columns (M, p) of what may follow a driver x in -1..1."""
    one = np.ones_like(x)
    return {
        "linear": np.column_stack([one, x]),
        "quadratic": np.column_stack([one, x * np.abs(x)]),
        "odd": np.column_stack([one, x, x * np.abs(x), x**3]),
        "even": np.column_stack([one, np.abs(x), x**2]),
        "sides": np.column_stack([one, np.maximum(x, 0) ** 2, -(np.maximum(-x, 0) ** 2)]),
        "linear_sides": np.column_stack([one, np.maximum(x, 0), -np.maximum(-x, 0)]),
    }


def fitted(columns: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Coefficients and residuals (NaN where y is) of least squares."""
    good = np.isfinite(y)
    beta: Floats = np.asarray(np.linalg.lstsq(columns[good], y[good], rcond=None)[0], dtype=np.float64)
    left: Floats = y - columns @ beta
    return beta, left


def explained(columns: Floats, y: Floats) -> float:
    """R^2."""
    good = np.isfinite(y)
    if np.count_nonzero(good) < policy.faults.CHANNEL_CELLS:
        return 0.0
    _, left = fitted(columns, y)
    total = float(np.var(y[good]))
    return 1.0 - float(np.mean(left[good] ** 2)) / total if total > 0 else 0.0


def by_blocks(cells: Cells, value: Floats) -> tuple[float, float, float]:
    """Mean of the blocks' means, its standard error, and the p-value that it is not above 0 (Student)."""
    good = np.isfinite(value)
    means = np.array([value[good & (cells.block == b)].mean() for b in np.unique(cells.block[good])])
    if means.size < 3:
        return float(np.mean(means)) if means.size else 0.0, np.inf, 1.0
    error = float(np.std(means, ddof=1) / np.sqrt(means.size))
    mean = float(means.mean())
    if error <= 0:
        return mean, 0.0, 0.0 if mean > 0 else 1.0
    return mean, error, float(student_sf(mean / error, means.size - 1))


def gain(cells: Cells, columns: Floats, y: Floats, which: int) -> tuple[float, float, float]:
    """Coefficient `which`, its standard error by leaving blocks out (jackknife), and the p-value of its sign.

    Efron, The Jackknife, SIAM 1982, ch. 3.
    """
    good = np.isfinite(y)
    blocks = np.unique(cells.block[good]).tolist()
    whole = float(fitted(columns, y)[0][which])
    left = []
    for b in blocks:
        keep = good & (cells.block != b)
        if np.count_nonzero(keep) > columns.shape[1]:
            left.append(float(np.linalg.lstsq(columns[keep], y[keep], rcond=None)[0][which]))
    n = len(left)
    if n < 3:
        return whole, np.inf, 1.0
    error = float(np.sqrt((n - 1) / n * np.sum((np.array(left) - np.mean(left)) ** 2)))
    p = 2 * float(student_sf(abs(whole) / error, n - 1)) if error > 0 else 0.0
    return whole, error, p
