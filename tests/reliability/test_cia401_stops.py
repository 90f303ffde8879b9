"""An analogue output on CANopen as control voltage, which would keep its last voltage as delivered: kill -9 of the
controller, a controller that hangs, a pulled cable, by the truth log of a bench in another process."""

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
    LiveBench,
    at_rest,
    attach,
    live_bench,
    turning,
    zero_after,
)

pytest.importorskip("canopen")
pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
BENCH = PROJECT / "benches" / "cia401"


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(_text: str) -> str:
    return (BENCH / "bench.toml").read_text().replace("min = -300.0 ", f"max_age = {PATIENCE}\nmin = -300.0 ")


def driven(bench: LiveBench):
    """A run whose hold at 10 V has begun."""
    run = bench.start()
    front = attach(run)
    front.begin(turning(10.0))
    return run, front


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_controller_that_is_killed_or_hangs(tmp_path, how, report, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        run, front = driven(bench)
        os.kill(run.pid, how)
        killed = time.monotonic_ns()
        assert at_rest(bench)
        latency = zero_after(bench.truth(), killed)
        report(f"CiA 401: {how.name} of the controller to 0 V", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, killed)
        os.kill(run.pid, signal.SIGKILL)
        bench.controllers[0].wait(15)
        front.peer.close()


def test_a_pulled_cable(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        _, front = driven(bench)
        bench.tell("fault", "can0", "pulled")
        pulled = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), pulled), WATCHDOG + TICK + SLACK, pulled)


def test_a_module_that_dies(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        _, front = driven(bench)
        bench.tell("fault", "motor", "silent")
        died = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert (last.outcome, "motor" in last.cause) == ("tripped", True)
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), died), WATCHDOG + TICK + SLACK, died)
