"""A virtual motor whose telemetry has noise, and can lie: the propeller does one thing and the rows say another."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.protocols import Sample
from tests.rig.virtual_bench import VirtualBench

Row = tuple[float, float]


@dataclass
class Telemetry:
    """Stands between a virtual motor and its rows from now on. `lie` turns (rev/s, A) into what is told."""

    world: VirtualBench
    noise: float = 0.005
    """rev/s; ten times that in A."""
    lie: Callable[[Row], Row] = lambda row: row
    frozen: Row | None = None
    last: Row = (0.0, 0.0)
    truth: list[tuple[float, float]] = field(default_factory=list)
    """(s, rev/s) of the propeller."""
    chance: random.Random = field(default_factory=lambda: random.Random(3))

    def __post_init__(self) -> None:
        self.step = self.world.motor.step
        self.world.motor.step = self.take

    def freeze(self) -> None:
        self.frozen = self.last

    def take(self, now: float, dt: float) -> None:
        motor = self.world.motor
        before = len(motor.rows)
        self.step(now, dt)
        self.truth.append((now, motor.rotation))
        for i, row in enumerate(motor.rows[before:], before):
            rate, current = row.values
            noisy = (rate + self.chance.gauss(0, self.noise), current + self.chance.gauss(0, 10 * self.noise))
            self.last = self.frozen or self.lie(noisy if self.noise else (rate, current))
            motor.rows[i] = Sample(row.stream, row.t_ns, self.last)
