"""What does the check of command against rotation, current and thrust cost per tick of the control loop?

    python benchmarks/controller/consistency_cost.py

A thruster is played through it at 50 Hz and at 1 kHz; printed are microseconds per tick: median, p99 and worst.
"""

from __future__ import annotations

import random
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from rig.safety.consistency.look import Look
from rig.safety.consistency.watch import Consistency

LEVELS = (0.0, 8.0, -8.0, 12.0, -12.0, 16.0, -16.0, 0.0) * 4
HOLD = 3.0
"""s"""


def cost(rate: float) -> list[float]:
    """Microseconds of each tick, sorted."""
    check, chance, taken = Consistency(0.5, 24.0), random.Random(1), []
    now = n = 0.0
    for volts in LEVELS:
        for _ in range(round(HOLD * rate)):
            now += 1.0 / rate
            n += (volts - n) / (0.1 * rate)
            look = Look(now, volts, n, 0.035 * n * n, 0.4 * n * abs(n) + chance.gauss(0.0, 0.02))
            begun = time.perf_counter_ns()
            cause = check.advance(look)
            taken.append((time.perf_counter_ns() - begun) * 1e-3)
            assert not cause, cause
    return sorted(taken)


for loop_rate in (50.0, 1000.0):
    ticks = cost(loop_rate)
    median, p99 = ticks[len(ticks) // 2], ticks[int(0.99 * len(ticks))]
    print(
        f"{loop_rate:6g} Hz: median {median:.1f} us, p99 {p99:.1f} us, worst {ticks[-1]:.0f} us of {len(ticks)} ticks"
    )
