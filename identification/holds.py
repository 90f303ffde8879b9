"""Windows of constant voltage: from the table of steps, else found in the command or in the measured voltage."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

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


def _runs(value: Floats, tolerance: float) -> list[tuple[int, int]]:
    """Half-open index ranges in which the value stays within `tolerance` of the run's first value; NaN ends a run."""
    runs = []
    start = 0
    for i in range(1, value.size + 1):
        ends = i == value.size or not abs(value[i] - value[start]) <= tolerance
        if ends:
            if np.isfinite(value[start]):
                runs.append((start, i))
            start = i
    return runs


def from_voltage(channel: Channel, t_last: float) -> tuple[Window, ...]:
    """Runs of constant value. Rows may be changes or dense samples; the last run lasts until `t_last`.

    A command is compared exactly; a measured voltage within its own noise, found from second differences (they
    ignore slopes, so a ramp or sine stays a ramp or sine).

    >>> time = np.array([0.0, 1.0, 2.0])
    >>> command = Channel("u", "command", "command_voltage", "V", time, np.array([0.0, 0.0, 5.0]))
    >>> [(w.voltage, w.t_start, w.t_end) for w in from_voltage(command, 4.0)]
    [(0.0, 0.0, 2.0), (5.0, 2.0, 4.0)]
    """
    time, value = channel.time, channel.value
    finite = value[np.isfinite(value)]
    if finite.size == 0:
        return ()
    tolerance = EQUAL * max(float(np.abs(finite).max()), 1e-9)
    if channel.quantity != "command_voltage" and finite.size > 8:
        curvature = np.abs(np.diff(finite, 2))
        tolerance = max(tolerance, NOISE_WIDTH * float(np.median(curvature)) * 1.4826 / float(np.sqrt(6.0)))
    windows = []
    for start, end in _runs(value, tolerance):
        t_end = float(time[end]) if end < time.size else max(t_last, float(time[end - 1]))
        if t_end > time[start]:
            windows.append(Window(float(np.mean(value[start:end])), float(time[start]), t_end, "hold"))
    return tuple(windows)


def overlap_free(windows: tuple[Window, ...]) -> bool:
    """No two windows share time (a table of steps written wrongly would count samples twice)."""
    ordered = sorted(windows, key=lambda w: w.t_start)
    return all(a.t_end <= b.t_start + 1e-9 for a, b in pairwise(ordered))
