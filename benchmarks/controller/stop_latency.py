"""From the operator's stop key to command 0 at the motor, end to end, many times.

    python benchmarks/controller/stop_latency.py [PRESSES]

Each press is a campaign of its own: `rig console` on a pty, a controller process and a simulated bench in a third
process, whose truth log has the clock of this machine. The key is written to the pty somewhere in a hold, on one of the
five pages in turn, alternating F9 and Ctrl+C. About nine seconds a press.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic_ns

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.reliability.live import LiveBench, live_bench, zero_after
from tests.reliability.test_console_stop import CTRL_C, F9, RIG, leave, start_from
from tests.rig.console.terminal import on_terminal

PROMISE = 0.1
"""s, p99 of 100 presses (docs/reliability.md, promise 4)."""
BATCH = 10


def press(bench: LiveBench, number: int) -> float:
    """s from one press to command 0."""
    run = bench.start(unattended=False, dwell=20.0)
    with on_terminal(RIG, "console", run.folder) as (process, terminal):
        start_from(terminal, bench)
        terminal.press(b"12345"[number % 5 :][:1])
        bench.until_held(10.0, 0.6 + 0.013 * number)
        pressed = monotonic_ns()
        terminal.press(F9 if number % 2 else CTRL_C)
        terminal.until(b"ABORTED")
        leave(process, terminal)
    bench.controllers[-1].wait(15)
    return zero_after(bench.truth(), pressed)


def batch(numbers: range) -> list[float]:
    """Presses on one bench; its truth log is read again and again, so it is kept short."""
    with TemporaryDirectory() as folder, live_bench(Path(folder)) as bench:
        return [press(bench, number) for number in numbers]


def main(presses: int = 20) -> None:
    """Print the quantiles in ms after each batch, over all so far."""
    seconds: list[float] = []
    for first in range(0, presses, BATCH):
        seconds += batch(range(first, min(first + BATCH, presses)))
        p50, p99, most = 1e3 * np.quantile(seconds, [0.5, 0.99, 1.0])
        print(f"stop key to command 0, {len(seconds)} presses: p50 {p50:.1f} ms, p99 {p99:.1f} ms, ", end="")
        print(f"max {most:.1f} ms (promise: p99 <= {1e3 * PROMISE:.0f} ms)", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
