"""What the plots of a console cost the control loop: the envelope of every tick, and the rows in every snapshot.

    python benchmarks/console/envelope_cost.py

Processor time of the thread. Eight channels at 1 kHz, each a stream of its own, at 50 ticks a second, and beside it a
usual bench: three streams of five channels, one row a tick. `advance`: microseconds of a tick. `encode`: of a snapshot
with 490 lines of log, without rows, with the one row that it has as a rule, and with as many as a console is sent that
has just attached.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import sin
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from drivers.protocols import Channel, Sample, Stream
from rig.control.envelopes import Envelopes
from rig.link.clients import TRACE_AT_ONCE
from rig.link.framing import encode
from tests.rig.console.feeds import running

TICKS, TURNS = 3000, 500
T0 = 5_000_000_000
FAST = [Stream(f"cell{n}", "cell", (Channel("force", "", "N"),), 0.001) for n in range(8)]
USUAL = [Stream(f"motor{n}", "motor", tuple(Channel(f"c{k}", "", "A") for k in range(5)), 0.02) for n in range(3)]


def quantiles(seconds: Sequence[float]) -> str:
    p50, p95, p99 = 1e6 * np.quantile(seconds, [0.5, 0.95, 0.99])
    return f"median {p50:.0f}, p95 {p95:.0f}, p99 {p99:.0f} us"


def ticks(streams: Sequence[Stream], rows: int) -> str:
    """`rows` of each stream in each tick."""
    envelopes, taken = Envelopes(streams), list[float]()
    for tick in range(TICKS):
        now = 5.0 + 0.02 * (tick + 1)
        samples = [
            Sample(s.name, round(now * 1e9), tuple(sin(tick + n + k) for k in range(len(s.channels))))
            for s in streams
            for n in range(rows)
        ]
        begin = time.thread_time()
        envelopes.advance(samples, 4.0, T0, now)
        taken.append(time.thread_time() - begin)
    return quantiles(taken)


def repeated(act: Callable[[], object]) -> str:
    taken = []
    for _ in range(TURNS):
        begin = time.thread_time()
        act()
        taken.append(time.thread_time() - begin)
    return quantiles(taken)


def main() -> None:
    print(f"advance, 8 channels at 1 kHz:          {ticks(FAST, 20)}")
    print(f"advance, 15 channels, one row a tick:  {ticks(USUAL, 1)}")
    shown = running()
    shown = replace(shown, log=shown.log * 70, log_count=490)
    row = tuple(0.123456789012 * n for n in range(1 + 2 * len(shown.channels)))
    for rows in (0, 1, TRACE_AT_ONCE):
        snapshot = replace(shown, trace=(row,) * rows)
        size = len(encode(snapshot))
        print(f"encode, {rows:2d} rows of {len(shown.channels)} channels, {size:6d} bytes: ", end="")
        print(repeated(lambda sent=snapshot: encode(sent)))


if __name__ == "__main__":
    main()
