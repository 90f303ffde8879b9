"""The command of a plan over its expected time, as corners to draw and to integrate over. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import ceil, pi
from typing import Final

import numpy as np

from identification.recording import Floats
from rig.campaign.plan import Step

PER_CYCLE: Final = 24
"""Corners of one cycle of a sine: its area is right to 1 %."""
MOST_CORNERS: Final = 20_000
"""Of one sine; longer ones are drawn coarser."""


@dataclass(frozen=True, slots=True)
class Level:
    """Holds of one voltage in a run."""

    voltage: float
    """V"""
    holds: int
    seconds: float
    """Expected time at it in all, s."""


def corners(steps: Iterable[Step]) -> tuple[Floats, Floats]:
    """Time in s and command in V, (n,) each: straight between one corner and the next, every step as long as expected.

    A jump is two corners of one time. Sines have at least PER_CYCLE corners a cycle, MOST_CORNERS at most.
    """
    found: list[tuple[float, float]] = []
    start = 0.0
    for step in steps:
        found += [(start + t, volts) for t, volts in _within(step)]
        start += step.expected
    table = np.array(found, dtype=np.float64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _within(step: Step) -> Iterator[tuple[float, float]]:
    """Corners of one step, time from its start."""
    seconds = step.expected
    if step.phase != "sine":
        yield 0.0, step.from_voltage if step.phase == "ramp" else step.voltage
        yield seconds, step.voltage
        return
    count = min(max(2, ceil(PER_CYCLE * step.frequency * seconds)), MOST_CORNERS)
    times = np.linspace(0.0, seconds, count + 1)
    volts = step.voltage + step.amplitude * np.sin(2 * pi * step.frequency * times)
    yield from zip(times.tolist(), volts.tolist(), strict=True)


def levels(steps: Iterable[Step]) -> tuple[Level, ...]:
    """Voltages that are held to be measured, from the lowest to the highest."""
    found: dict[float, tuple[int, float]] = {}
    for step in steps:
        if step.phase == "hold":
            holds, seconds = found.get(step.voltage, (0, 0.0))
            found[step.voltage] = (holds + 1, seconds + step.expected)
    return tuple(Level(volts, *found[volts]) for volts in sorted(found))
