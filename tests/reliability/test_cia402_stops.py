"""A CiA 402 drive on an slcan adapter, which waits for our heartbeat: kill -9 of the controller, a controller that
hangs, a pulled cable, a drive that dies, by the truth log of a bench in another process."""

from __future__ import annotations

import os
import signal
import time

import pytest

from drivers.ports.can_bus import CanBus
from rig.campaign.loading import load_bench
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

pytest.importorskip("canopen")
pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]
BENCH = PROJECT / "benches" / "cia402"


def world(_text: str) -> str:
    return (BENCH / "world.toml").read_text()


def bench_file(_text: str) -> str:
    """The cell is asked by the loop, so that a late loop has old rows of it; `whole` is for the same."""
    text = whole((BENCH / "bench.toml").read_text())
    return text.replace("[mount]", f'[limits."motor.rotation_rate"]\nmax_age = {PATIENCE}\n\n[mount]')


def test_campaign_completes_and_the_watchdog_is_proved(tmp_path, report):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start(prove=True, dwell=2.0))
        last = front.to_the_end(bench)
        assert (last.outcome, last.cause) == ("completed", "")
        timeouts = [line for line in bench.truth() if line["event"] == "timeout"]
        assert timeouts[0]["after"] == pytest.approx(WATCHDOG, abs=TICK + SLACK)
        report("CiA 402: watchdog measured at the device", timeouts[0]["after"], "s")


def test_kill_9_and_whoever_comes_next(tmp_path, report, prompt):
    from drivers.canopen.cia402 import Cia402

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
        report("CiA 402: kill -9 of the controller to zero", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, killed)

        opened = time.monotonic_ns()
        bus = CanBus("slcan", str(bench.folder / "ports" / "can0"), 500_000)
        bus.open()
        device = Cia402("motor", load_bench(bench.folder / "bench.toml").devices["motor"].options, bus)
        device.open()
        for _ in range(25):
            device.command(0.0)
            time.sleep(TICK)
            device.drain()
        assert at_rest(bench)
        device.close()
        bus.close()
        later = [line for line in bench.truth() if line["event"] == "command" and line["t_ns"] > opened]
        assert not [line for line in later if line["value"]], "nothing is driven on"


def test_a_controller_that_hangs_sends_no_heartbeat(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        run = bench.start()
        front = attach(run)
        front.begin(turning(10.0))
        os.kill(run.pid, signal.SIGSTOP)
        stopped = time.monotonic_ns()
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), stopped), WATCHDOG + TICK + SLACK, stopped)
        os.kill(run.pid, signal.SIGCONT)
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        zero_after(bench.truth(), stopped)


def test_a_pulled_cable(tmp_path, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start())
        front.begin(turning(10.0))
        pulled = tell(bench, "can0", "pulled")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert at_rest(bench)
        prompt(zero_after(bench.truth(), pulled), WATCHDOG + TICK + SLACK, pulled)
        bench.tell("clear", "can0")
        assert at_rest(bench)


@pytest.mark.parametrize("fault", ["silent", "no_heartbeat", "over_current"])
def test_a_drive_that_dies(tmp_path, fault, prompt):
    with live_bench(tmp_path, world, bench_file) as bench:
        front = attach(bench.start())
        front.begin(turning(10.0))
        died = tell(bench, "motor", fault)
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert "motor" in last.cause
        assert at_rest(bench)
        before = died - 10_000_000  # the drive's own stop is in the log just before its fault
        prompt(zero_after(bench.truth(), before), WATCHDOG + PATIENCE + TICK + SLACK, died)


def tell(bench: LiveBench, target: str, fault: str) -> int:
    """When the fault began, ns."""
    bench.tell("fault", target, fault)
    return next(line["t_ns"] for line in reversed(bench.truth()) if line["event"] == "fault")
