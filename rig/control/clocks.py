"""The clocks of the controller: the one of every sample, and those that tell whether the machine slept or was set."""

from __future__ import annotations

import time
from typing import Protocol

from rig.safety.lost_time import HostClocks

TRIES = 3
CLOSE_NS = 1_000_000
"""ns within which the clocks are read one after another; a reading that was interrupted is taken again."""


class Clock(Protocol):
    """The machine's monotonic clock, or a test's."""

    def now_ns(self) -> int: ...

    def sleep_until_ns(self, t_ns: int) -> None: ...


class MonotonicClock:
    """CLOCK_MONOTONIC, the clock of every sample."""

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        time.sleep(max(t_ns - time.monotonic_ns(), 0) * 1e-9)


def host_clocks() -> HostClocks:
    """A look at all of them takes two microseconds. A stop of the process between two of them reads as sleep, which it
    is to the motor."""
    for _ in range(TRIES):
        before = time.monotonic_ns()
        boot, utc = time.clock_gettime_ns(time.CLOCK_BOOTTIME), time.time_ns()
        found = HostClocks(boot - before, utc - boot)
        if time.monotonic_ns() - before < CLOSE_NS:
            break
    return found
