"""A bench supply over a pty, whose watchdog switches its output off: kill -9 of the controller, a pulled cable, and who
comes next, by the truth log of a bench in another process."""

from __future__ import annotations

import os
import signal
import time

import pytest

from drivers.scpi.options import Options
from drivers.scpi.supply import ScpiSupply
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
FORWARD = {"[10.0, -10.0, 6.0, -6.0]": "[10.0, 6.0, 8.0, 12.0]"}
"""In the campaign: a supply has one direction."""
BENCH = PROJECT / "benches" / "scpi_supply"


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(_text: str) -> str:
    text = (BENCH / "bench.toml").read_text()
    return text.replace("min = -300.0 ", f"max_age = {PATIENCE}\nmin = -300.0 ")


def test_kill_9_and_whoever_comes_next(tmp_path, report, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        run = bench.start(**FORWARD)
        front = attach(run)
        front.begin(turning(10.0))
        os.kill(run.pid, signal.SIGKILL)
        killed = time.monotonic_ns()
        bench.controllers[0].wait(15)
        front.peer.close()
        assert at_rest(bench)
        latency = zero_after(bench.truth(), killed)
        report("SCPI supply: kill -9 of the controller to output off", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, killed)

        options = Options(str(bench.folder / "ports" / "motor"), 24.0, 20.0, WATCHDOG, baud=115200)
        device, opened = ScpiSupply("motor", options), time.monotonic_ns()
        device.open()
        device.command(0.0)
        assert at_rest(bench)
        device.close()
        later = [line for line in bench.truth() if line["event"] == "command" and line["t_ns"] > opened]
        assert all(line["value"] == 0.0 for line in later), "there is nothing to go on with"


def test_a_pulled_cable(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start(**FORWARD))
        front.begin(turning(10.0))
        bench.tell("fault", "motor", "pulled")
        pulled = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), pulled), WATCHDOG + TICK + SLACK, pulled)
        bench.tell("clear", "motor")
        assert at_rest(bench)
