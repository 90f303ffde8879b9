"""Channels that explain, on the intervals of a run: their noise is averaged, or effects would look smaller."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from identification.mismatch import policy
from identification.mismatch.prepare.grid import Held
from identification.recording import Channel, Floats, Recording

CALMED = ("flow_speed", "motor_temperature", "water_temperature")
REACHES = (4, 16, 64, 256)
"""Samples on either side that are averaged: as many as let the neighbours foretell each sample best."""
LOADS = 6
"""Columns of a load."""


def followed(channel: Channel, at: Floats) -> Floats | None:
    """Interpolated, its noise averaged between its jumps: noise in what explains makes effects look smaller."""
    good = np.isfinite(channel.value)
    if np.count_nonzero(good) < 2:
        return None
    time, value = channel.time[good], channel.value[good]
    if channel.quantity in CALMED:
        value = calmest(value, (1, *REACHES), channel.acquisition.quantum or 0.0)[0]
    out: Floats = np.interp(at, time, value)
    return out


def jumps(value: Floats, quantum: float = 0.0) -> NDArray[np.bool_]:
    """(n-1,) where neighbouring samples differ by far more than their noise, and by more than two steps of the
    readings, which a value between two of them takes when it likes."""
    step = np.abs(np.diff(value))
    noise = float(np.median(step)) / 0.6745
    least = max(2.5 * quantum, 1e-9 * float(np.max(np.abs(value), initial=0.0)))
    return step > max(policy.prepare.CHANNEL_JUMP_SIGMA * noise, least)


def calmest(
    value: Floats, reaches: Sequence[int], quantum: float, apart: NDArray[np.bool_] | None = None
) -> tuple[Floats, float]:
    """`_calm` with the reach whose windows miss their samples least."""
    return min((_calm(value, reach, quantum, apart) for reach in reaches), key=lambda each: each[1])


def _calm(value: Floats, reach: int, quantum: float, apart: NDArray[np.bool_] | None) -> tuple[Floats, float]:
    """Running mean over up to `reach` samples on either side, never across a jump or where `apart` (n-1,); and the
    mean square by which the others in the window miss each sample."""
    cut = jumps(value, quantum) if apart is None else jumps(value, quantum) | apart
    starts = np.concatenate([[0], np.flatnonzero(cut) + 1, [value.size]])
    index = np.arange(value.size)
    which = np.searchsorted(starts, index, side="right") - 1
    width = np.minimum(np.minimum(index - starts[which], starts[which + 1] - 1 - index), reach)
    total = np.concatenate([[0.0], np.cumsum(value - value[0])])
    out: Floats = value[0] + (total[index + width + 1] - total[index - width]) / (2 * width + 1)
    others = width > 0
    missed = (value - out)[others] * (1 + 0.5 / width[others])
    return out, float(np.mean(missed**2)) if missed.size else np.inf


def _calm_where_it_rests(value: Floats, apart: NDArray[np.bool_]) -> Floats:
    """Running mean over a window that grows at each sample as long as what it adds changes no more than noise does
    (Lepski's rule): narrow while it follows a step, wide where it rests; never across a jump or where `apart`."""
    starts = np.concatenate([[0], np.flatnonzero(jumps(value) | apart) + 1, [value.size]])
    index = np.arange(value.size)
    which = np.searchsorted(starts, index, side="right") - 1
    total = np.concatenate([[0.0], np.cumsum(value - value[0])])
    std = float(np.median(np.abs(np.diff(value)))) / 0.6745 / np.sqrt(2)
    out, many, grows = value, np.ones(value.size), np.ones(value.size, dtype=bool)
    for reach in (1, 2, *REACHES):
        low, high = np.maximum(index - reach, starts[which]), np.minimum(index + reach + 1, starts[which + 1])
        mean = value[0] + (total[high] - total[low]) / (high - low)
        grows &= np.abs(mean - out) <= policy.prepare.CHANNEL_WINDOW_SIGMA * std / np.sqrt(many)
        out, many = np.where(grows, mean, out), np.where(grows, high - low, many)
    return out


def step_of(channel: Channel | None) -> float:
    """Of its readings, in its own unit; 0 where none is known."""
    return 0.0 if channel is None else channel.acquisition.quantum or 0.0


def coarseness(channel: Channel | None, moved: Floats) -> float:
    """What a step of its readings hides of how it `moved` (M,): standard deviation, as a share of all of that; 0 of one
    that moved over many steps."""
    step = step_of(channel)
    far = float(np.ptp(moved))
    if far >= policy.prepare.COARSE_STEPS * step:
        return 0.0
    return step / sqrt(12) / max(far, step / policy.prepare.COARSE_STEPS)


def torque(channel: Channel, held: Held, edges: Floats, driven: Floats) -> Floats | None:
    """(M,) what the driver makes of it, and the rest, whose noise is averaged between steps: noise in a torque would
    hide how much of it the cell feels."""
    good = np.isfinite(channel.value)
    if np.count_nonzero(good) < 2 * LOADS:
        return followed(channel, 0.5 * (edges[1:] + edges[:-1]))
    time, value = channel.time[good], channel.value[good]
    size = float(np.max(np.abs(driven))) or 1.0
    then = driven_at(held, time)

    def columns(v: Floats) -> Floats:
        u = v / size
        return np.column_stack([np.ones(u.size), u, np.abs(u), u * np.abs(u), u**2])

    law = np.linalg.lstsq(columns(then), value, rcond=None)[0]
    smooth = _calm_where_it_rests(
        value - columns(then) @ law, np.abs(np.diff(then)) > policy.prepare.COMMAND_STEP * size
    )
    out: Floats = columns(driven) @ law + _means(time, smooth, edges)
    return out


def _means(time: Floats, value: Floats, edges: Floats) -> Floats:
    """(M,) of the samples in each interval; interpolated where there are none."""
    inside = (time >= edges[0]) & (time < edges[-1])
    index = np.searchsorted(edges, time[inside], side="right") - 1
    count = np.bincount(index, minlength=edges.size - 1)
    total = np.bincount(index, weights=value[inside], minlength=edges.size - 1)
    between = np.interp(0.5 * (edges[1:] + edges[:-1]), time, value)
    return np.where(count > 0, total / np.maximum(count, 1), between)


def driven_at(held: Held, time: Floats) -> Floats:
    """(n,) the driver at each time."""
    if not held.stepwise:
        line: Floats = np.interp(time, held.time, held.value)
        return line
    index = np.clip(np.searchsorted(held.time, time, side="right") - 1, 0, held.time.size - 1)
    out: Floats = held.value[index]
    return out


def neighbour_of(recording: Recording) -> Channel | None:
    """Thrust of another thruster, or else its command, where one was recorded beside this one."""
    beside = (
        channel
        for quantity in ("thrust", "command_voltage")
        for channel in recording.all_of(quantity)
        if channel.thruster not in (None, "", recording.thruster)
    )
    return next(beside, None)


def neighbour_at(recording: Recording, at: Floats) -> Floats | None:
    """Thrust of another thruster, or its command squared, where one was recorded beside this one."""
    channel = neighbour_of(recording)
    if channel is None or channel.quantity == "thrust":
        return None if channel is None else followed(channel, at)
    value = channel.held_at(at)
    out: Floats = np.where(np.isfinite(value), value * np.abs(value), 0.0)
    return out
