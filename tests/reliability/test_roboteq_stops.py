"""A Roboteq on a pty, whose watchdog stops the motor and whose next command would resume it: kill -9 of the controller,
a pulled cable, and who comes next, by the truth log of a bench in another process."""

from __future__ import annotations

import os
import signal
import time

import pytest
import serial

from drivers.roboteq.controller import Roboteq
from drivers.roboteq.options import Options
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
    whole,
    zero_after,
)

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
BENCH = PROJECT / "benches" / "roboteq"


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(_text: str) -> str:
    """It is asked by the loop, so that a late loop has old rows of it; `whole` is for the same."""
    text = whole((BENCH / "bench.toml").read_text())
    return text.replace("[mount]", f'[limits."motor.rotation_rate"]\nmax_age = {PATIENCE}\n\n[mount]')


def port(bench: LiveBench) -> str:
    return str(bench.folder / "ports" / "motor")


def test_campaign_completes_and_the_watchdog_is_proved(tmp_path, report):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start(prove=True, dwell=0.6))
        last = front.to_the_end(bench)
        assert (last.outcome, last.cause) == ("completed", "")
        timeouts = [line for line in bench.truth() if line["event"] == "timeout"]
        assert timeouts[0]["after"] == pytest.approx(WATCHDOG, abs=TICK + SLACK)
        report("Roboteq: watchdog measured at the device", timeouts[0]["after"], "s")


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
        report("Roboteq: kill -9 of the controller to power 0", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, killed)

        options = Options(port(bench), nominal_bus_voltage=48.0, watchdog_timeout=WATCHDOG, rotation="brushless")
        device, opened = Roboteq("motor", options), time.monotonic_ns()
        device.open()
        assert at_rest(bench)
        device.close()
        later = [line for line in bench.truth() if line["event"] == "command" and line["t_ns"] > opened]
        assert [line["value"] for line in later] == [0], "our first word is 0, and there is nothing to go on with"


def test_a_naive_host_that_comes_next_makes_the_propeller_turn(tmp_path):
    """The trap is there: the same kill, and a host that sets an acceleration before it has commanded 0."""
    with live_bench(tmp_path, world, bench_file) as bench:
        run = bench.start()
        front = attach(run)
        front.begin(turning(10.0))
        os.kill(run.pid, signal.SIGKILL)
        bench.controllers[0].wait(15)
        front.peer.close()
        assert at_rest(bench)
        with serial.Serial(port(bench), 115200, timeout=2.0) as naive:
            naive.write(b"!AC 1 5000\r")
            assert naive.read_until(b"\r") == b"+\r"
            driven = [line for line in bench.truth() if line["event"] == "command"][-1]
            assert driven["value"] == 208  # 10 V of 48 V
        assert at_rest(bench)


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
