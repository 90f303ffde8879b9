"""How long thrust takes to follow a step, without any model of why: by the area between the step and the answer.

After a step at t_0 from F_0 to F_1 the mean time by which the answer is late is the area (F_1 - F) dt / (F_1 - F_0)
(Astrom and Hagglund, PID Controllers, 1995, 2.4, the method of areas): the time constant of a first-order lag and the
time of a pure delay alike, and less where thrust overshoots.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from identification.recording import Floats, Recording, Step

SETTLED = 1 / 3
"""The last share of a hold, whose mean is what thrust settles to."""
FEWEST = 6
"""Samples of that."""
LEAST_STEP = 0.1
"""Share of the largest thrust, below which a step tells of noise."""


@dataclass(frozen=True, slots=True)
class SettlingTime:
    """Mean over all steps, each weighed by the square of its size, in s."""

    value: float
    std: float
    """Of the noise of the samples."""
    steps: int


@dataclass(frozen=True, eq=False, slots=True)
class _Hold:
    time: Floats
    thrust: Floats
    end: float
    level: float
    """N, that it settles to."""
    scatter: float


def settling_time(recording: Recording) -> SettlingTime | None:
    """Of thrust after the steps between the recording's levels; None where it has no two that differ.

    Only levels that follow one another at once count: after a ramp nothing is late.
    """
    channel = recording.first_of("thrust")
    if channel is None:
        return None
    good = np.isfinite(channel.value)
    time, thrust = channel.time[good], channel.value[good]
    pairs = [(_hold(a, time, thrust), _hold(b, time, thrust)) for a, b in _one_after_another(recording)]
    both = [(a, b) for a, b in pairs if a is not None and b is not None]
    if not both:
        return None
    size = np.array([b.level - a.level for a, b in both])
    large = np.abs(size) > LEAST_STEP * max(abs(hold.level) for pair in both for hold in pair)
    if not large.any():
        return None
    late, noise = np.array([_late(a, b) for (a, b), told in zip(both, large, strict=True) if told]).T
    weight = size[large] ** 2 / np.sum(size[large] ** 2)
    return SettlingTime(float(weight @ late), float(np.sqrt(weight**2 @ noise**2)), int(np.count_nonzero(large)))


def _one_after_another(recording: Recording) -> Iterator[tuple[Step, Step]]:
    for before, after in zip(recording.steps, recording.steps[1:], strict=False):
        held = before.phase in ("hold", "tare", "rest") and after.phase in ("hold", "tare", "rest")
        if held and before.command_voltage != after.command_voltage and after.t_start - before.t_end < 1e-3:
            yield before, after


def _hold(step: Step, time: Floats, thrust: Floats) -> _Hold | None:
    first, last = np.searchsorted(time, (step.t_start, step.t_end))
    late = np.searchsorted(time, step.t_end - SETTLED * (step.t_end - step.t_start))
    if last - late < FEWEST:
        return None
    settled = thrust[late:last]
    return _Hold(time[first:last], thrust[first:last], step.t_end, float(settled.mean()), float(settled.std(ddof=1)))


def _late(before: _Hold, after: _Hold) -> tuple[float, float]:
    """By how many s the answer to one step is late, and its standard error by the noise."""
    begun = before.end
    edges = np.append(np.append(begun, 0.5 * (after.time[1:] + after.time[:-1])), after.end)
    share = np.diff(edges)
    size = after.level - before.level
    late = float(np.sum((after.level - after.thrust) * share)) / size
    duration = after.end - begun  # of its last part the area is zero: that is where its level comes from
    samples = after.time.size
    area = after.scatter * duration * np.sqrt((1.0 - SETTLED) / SETTLED / samples)
    start = late * before.scatter / np.sqrt(SETTLED * samples) / size
    return late, float(np.hypot(area / size, start))
