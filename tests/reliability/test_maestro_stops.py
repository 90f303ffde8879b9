"""An ESC on a Maestro over a pty, whose only watchdog is the Maestro's serial timeout: kill -9 of the controller, a
pulled cable, and whoever comes next, by the truth log of a bench in another process."""

from __future__ import annotations

import os
import signal
import time

import pytest

from drivers.pololu.maestro import Maestro
from drivers.pololu.maestro_options import Options
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

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
BENCH = PROJECT / "benches" / "maestro"
PULSE = 0.02
"""s between two pulses: a width begins at the next."""


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(_text: str) -> str:
    text = (BENCH / "bench.toml").read_text()
    return text.replace("min = -300.0 ", f"max_age = {PATIENCE}\nmin = -300.0 ")


def port(bench: LiveBench) -> str:
    return str(bench.folder / "ports" / "motor")


def test_campaign_completes_and_the_watchdog_is_proved(tmp_path, report):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start(prove=True, dwell=0.6))
        last = front.to_the_end(bench)
        assert (last.outcome, last.cause) == ("completed", "")
        timeouts = [line for line in bench.truth() if line["event"] == "timeout"]
        assert len(timeouts) >= 2, "once at opening inside the dead zone, once with the propeller turning"
        report("Maestro: watchdog measured at the device", timeouts[-1]["after"], "s")


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
        report("Maestro: kill -9 of the controller to neutral", latency, "s")
        prompt(latency, WATCHDOG + TICK + PULSE + SLACK, killed)

        options = Options(
            port(bench), channel=0, full_voltage=48.0, dead_zone=25.0, watchdog_timeout=WATCHDOG, arming_time=0.5
        )
        device, opened = Maestro("motor", options), time.monotonic_ns()
        device.open()
        assert at_rest(bench)
        device.close()
        later = [line for line in bench.truth() if line["event"] == "command" and line["t_ns"] > opened]
        assert {line["volts"] for line in later} <= {0.0}, "never beyond the dead zone"


def test_a_pulled_cable(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start())
        front.begin(turning(10.0))
        bench.tell("fault", "motor", "pulled")
        pulled = next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), pulled), WATCHDOG + TICK + PULSE + SLACK, pulled)
        bench.tell("clear", "motor")
        assert at_rest(bench)
