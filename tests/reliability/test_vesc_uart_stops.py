"""A VESC on a pty: kill -9 of the controller and a pulled cable, by the truth log of a bench in another process."""

from __future__ import annotations

import os
import signal
import time

import pytest

from tests.reliability.live import (
    PROJECT,
    SLACK,
    TICK,
    WATCHDOG,
    at_rest,
    attach,
    live_bench,
    turning,
    zero_after,
)
from tests.reliability.test_roboteq_stops import bench_file as roboteq_file

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
BENCH = PROJECT / "benches" / "vesc_uart"


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(text: str) -> str:
    """It is asked by the loop, as a Roboteq is: a late loop has old rows of it."""
    ours = (BENCH / "bench.toml").read_text()
    motor = ours[ours.index("[devices.motor]") : ours.index('[limits."load_cell')]
    theirs = roboteq_file(text)
    begin, end = theirs.index("[devices.motor]"), theirs.index('[limits."load_cell')
    return theirs[:begin] + motor + theirs[end:]


def test_kill_9(tmp_path, report, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        run = bench.start()
        front = attach(run)
        front.begin(turning(10.0))
        os.kill(run.pid, signal.SIGKILL)
        killed = time.monotonic_ns()
        bench.controllers[0].wait(15)
        front.peer.close()
        assert at_rest(bench)
        latency = zero_after(bench.truth(), killed)
        report("VESC by UART: kill -9 of the controller to released", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, killed)


def test_a_pulled_cable(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start())
        front.begin(turning(10.0))
        bench.tell("fault", "motor", "pulled")
        pulled = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), pulled), WATCHDOG + TICK + SLACK, pulled)
        bench.tell("clear", "motor")
        assert at_rest(bench)
