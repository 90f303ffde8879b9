"""Windows of constant voltage: from the table of steps, else found in the command or in the measured voltage."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.recording import Channel, Floats, Recording

STEADY_PHASES = ("hold", "rest", "tare")
EQUAL = 1e-6
"""Two commands are the same level when they differ by less than this share of the largest one."""
NOISE_WIDTH = 4.0
"""A measured voltage stays on its level within this many standard deviations of its noise."""


@dataclass(frozen=True, slots=True)
class Window:
    """t_start <= t < t_end at one level, V."""

    voltage: float
    t_start: float
    t_end: float
    phase: str


def from_steps(recording: Recording) -> tuple[Window, ...]:
    """Holds, rests and tares of the table of steps; a step that never ended or has no length is left out."""
    return tuple(
        Window(step.command_voltage, step.t_start, step.t_end, step.phase)
        for step in recording.steps
        if step.phase in STEADY_PHASES and step.t_end > step.t_start and np.isfinite(step.command_voltage)
    )


def without_waiting(windows: tuple[Window, ...]) -> tuple[Window, ...]:
    """Without rests where there are tares: such a rest is the wait for a released rotor, the tare is the measurement.

    >>> windows = (Window(0.0, 0.0, 1.0, "rest"), Window(0.0, 1.0, 3.0, "tare"), Window(5.0, 3.0, 4.0, "hold"))
    >>> [w.phase for w in without_waiting(windows)]
    ['tare', 'hold']
    """
    if not any(w.phase == "tare" for w in windows):
        return windows
    return tuple(w for w in windows if w.phase != "rest")


def _starts(value: Floats, tolerance: float, measured: bool) -> NDArray[np.intp]:
    """First index of each run. A command's run ends at a change; a measured one where it leaves its first value."""
    if not measured:
        return np.concatenate([[0], np.flatnonzero(~(np.abs(np.diff(value)) <= tolerance)) + 1]).astype(np.intp)
    starts, first = [0], float(value[0])
    for i, v in enumerate(value.tolist()):
        if not abs(v - first) <= tolerance and i > 0:
            starts.append(i)
            first = v
    return np.array(starts, dtype=np.intp)


def from_voltage(channel: Channel, times: Floats, least: int = 1) -> tuple[Window, ...]:
    """Runs of constant value that hold at least `least` of `times`. Rows may be changes or dense samples.

    A command is compared exactly; a measured voltage within its own noise, found from second differences (they
    ignore slopes, so a ramp or sine stays a ramp or sine).

    >>> rows = np.array([0.0, 1.0, 2.0])
    >>> command = Channel("u", "command", "command_voltage", "V", rows, np.array([0.0, 0.0, 5.0]))
    >>> [(w.voltage, w.t_start, w.t_end) for w in from_voltage(command, np.array([0.5, 2.5, 4.0]))]
    [(0.0, 0.0, 2.0), (5.0, 2.0, 4.000000000000001)]
    """
    time, value = channel.time, channel.value
    finite = value[np.isfinite(value)]
    if finite.size == 0 or times.size == 0:
        return ()
    tolerance = EQUAL * max(float(np.abs(finite).max()), 1e-9)
    measured = channel.quantity != "command_voltage"
    if measured and finite.size > 8:
        curvature = np.abs(np.diff(finite, 2))
        tolerance = max(tolerance, NOISE_WIDTH * float(np.median(curvature)) * 1.4826 / float(np.sqrt(6.0)))
    starts = _starts(value, tolerance, measured)
    ends = np.append(time[starts[1:]], max(float(np.nextafter(times[-1], np.inf)), float(time[-1])))
    levels = np.add.reduceat(value, starts) / np.diff(np.append(starts, value.size))
    counts = np.searchsorted(times, ends) - np.searchsorted(times, time[starts])
    kept = np.flatnonzero((counts >= least) & np.isfinite(levels) & (ends > time[starts]))
    return tuple(Window(float(levels[k]), float(time[starts[k]]), float(ends[k]), "hold") for k in kept)


def overlap_free(windows: tuple[Window, ...]) -> bool:
    """No two windows share time (a table of steps written wrongly would count samples twice)."""
    ordered = sorted(windows, key=lambda w: w.t_start)
    return all(a.t_end <= b.t_start + 1e-9 for a, b in pairwise(ordered))
