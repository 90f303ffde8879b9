"""A DroneCAN ESC on an slcan pty, whose watchdog stops it: kill -9 of the controller, a pulled adapter, and who comes
next, by the truth log of a bench in another process."""

from __future__ import annotations

import os
import signal
import time

import pytest

from drivers.dronecan.esc import DronecanEsc
from drivers.dronecan.options import Options
from drivers.ports.can_bus import CanBus
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
    whole,
    zero_after,
)

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
BENCH = PROJECT / "benches" / "dronecan"


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(_text: str) -> str:
    text = whole((BENCH / "bench.toml").read_text())
    return text.replace("[mount]", f'[limits."motor.rotation_rate"]\nmax_age = {PATIENCE}\n\n[mount]')


def test_campaign_completes_and_the_watchdog_is_proved(tmp_path, report):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start(prove=True, dwell=0.6))
        last = front.to_the_end(bench)
        assert (last.outcome, last.cause) == ("completed", "")
        proved = [line for line in bench.truth() if line["event"] == "timeout"][-1]
        assert proved["after"] == pytest.approx(WATCHDOG, abs=TICK + SLACK)
        report("DroneCAN: watchdog measured at the device", proved["after"], "s")


def test_kill_9_and_whoever_comes_next(tmp_path, report, prompt):
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
        report("DroneCAN: kill -9 of the controller to set-point 0", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, killed)

        bus, opened = CanBus("slcan", str(bench.folder / "ports" / "can0"), 1_000_000), time.monotonic_ns()
        bus.open()
        device = DronecanEsc("motor", Options("bus0", 42, 24.0, 48.0, WATCHDOG, reversible=True), bus)
        device.open()
        device.command(0.0)
        assert at_rest(bench)
        device.close()
        bus.close()
        later = [line for line in bench.truth() if line["event"] == "command" and line["t_ns"] > opened]
        assert all(line["value"] == 0.0 for line in later), "there is nothing to go on with"


def test_a_pulled_adapter(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start())
        front.begin(turning(10.0))
        bench.tell("fault", "can0", "pulled")
        pulled = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), pulled), WATCHDOG + TICK + SLACK, pulled)
        bench.tell("clear", "can0")
        assert at_rest(bench)
