"""A Simple Motor Controller G2 on a pty: kill -9 of the controller and a pulled cable, by the truth log of a bench in
another process."""

from __future__ import annotations

import os
import signal
import time

import pytest

from tests.reliability.live import (
    PATIENCE,
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

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
BENCH = PROJECT / "benches" / "smc_g2"


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(_text: str) -> str:
    return (BENCH / "bench.toml").read_text().replace("min = -300.0 ", f"max_age = {PATIENCE}\nmin = -300.0 ")


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
        report("SMC G2: kill -9 of the controller to speed 0", latency, "s")
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
