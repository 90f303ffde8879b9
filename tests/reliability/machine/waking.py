"""A process that drives a virtual motor in real time, says every command it sends, and begins anew after each trip.

python -m tests.reliability.machine.waking FOLDER TIMES
"""

from __future__ import annotations

import sys
from pathlib import Path

from rig.control.clocks import MonotonicClock, host_clocks
from rig.control.loop import Decision, Inputs
from tests.rig.virtual_bench import VirtualBench, virtual

ZEROS = 5
"""Ticks at 0 V after a trip, before the next drive is armed."""
WARM = 10
"""Ticks before the guard judges."""


class RealTime:
    """The machine's clock; the world runs on while the loop sleeps."""

    def __init__(self, bench: VirtualBench) -> None:
        self._bench, self._clock = bench, MonotonicClock()

    def now_ns(self) -> int:
        return self._clock.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self._clock.sleep_until_ns(t_ns)
        now = self._clock.now_ns() * 1e-9
        self._bench.step(now)
        self._bench.recorder.step(now)


def drive(folder: Path) -> None:
    """6 V until the guard trips, then a few zeros."""
    folder.mkdir()
    with virtual(folder) as world:
        loop, motor = world.session.loop, world.motor
        loop.clock, loop.host = RealTime(world), host_clocks
        sent = motor.command
        trips: list[str] = []

        def command(volts: float) -> None:
            sent(volts)
            sys.stdout.write(f"{volts:g}\n")
            sys.stdout.flush()

        def decide(inputs: Inputs) -> Decision:
            if inputs.trip:
                trips.append(inputs.trip.cause)
            return Decision(0.0 if trips else 6.0)

        motor.command = command  # type: ignore[method-assign]  # the wire: what leaves is what is said
        for _ in range(WARM):
            loop.tick(motor, decide)
        loop.begin_guarding()
        while len(trips) < ZEROS:
            loop.tick(motor, decide)


if __name__ == "__main__":
    for number in range(int(sys.argv[2])):
        drive(Path(sys.argv[1]) / str(number))
