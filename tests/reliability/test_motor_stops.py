"""The propeller stops: whatever dies, hangs or is pulled, by the truth log of a bench in another process."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from rig.hdf5 import load
from rig.link.front_end_messages import Request
from rig.link.sockets import connect
from rig.recording.ledger import read
from rig.recording.recover import recover_command
from tests.reliability.live import (
    PATIENCE,
    SLACK,
    TICK,
    WATCHDOG,
    FrontEnd,
    LiveBench,
    at_rest,
    attach,
    live_bench,
    turning,
    whole,
    zero_after,
)

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]


def recorder_pid(controller: int) -> int:
    children = Path(f"/proc/{controller}/task/{controller}/children").read_text().split()
    return next(int(pid) for pid in children if "rig.recording.recorder" in Path(f"/proc/{pid}/cmdline").read_text())


def the_recording(bench: LiveBench):
    (path,) = (bench.folder / "out").glob("*/T1.h5")
    return load(path)


def under_way(bench: LiveBench, volts: float = 10.0, **options) -> tuple[FrontEnd, int]:
    """A run whose propeller turns at `volts`."""
    run = bench.start(**options)
    front = attach(run)
    front.begin(turning(volts))
    return front, run.pid


def test_campaign_completes_and_the_watchdog_is_proved(tmp_path, report):
    """With every device of the bench. Who the devices are, what the preflight found and how late the loop was are in
    the file, not only in the log.
    """
    with live_bench(tmp_path, edit_bench=whole) as bench:
        front = attach(bench.start(prove=True, dwell=0.6))
        last = front.to_the_end(bench)
        assert (last.outcome, last.cause) == ("completed", "")
        recording = the_recording(bench)
        assert recording.outcome == "completed"
        assert recording.complete
        assert [s.command_voltage for s in recording.steps if s.phase == "hold"] == [10.0, -10.0, 6.0, -6.0]
        end = next(fact for fact in read(Path(bench.runs[0].folder)) if fact["fact"] == "run_end")
        assert WATCHDOG <= end["time_to_zero_s"] < WATCHDOG + 3.0
        report("watchdog proof: time to zero", end["time_to_zero_s"], "s")
        before = [event.text for event in recording.events if event.time <= 0]
        checked = ("watchdog", "load_cell rate", "flow rate", "thermometer rate")
        for wanted in ("motor: VESC", *(f"preflight: {what}" for what in checked), "T1 mounted", "scheduling"):
            assert any(wanted in text for text in before), wanted
        assert any("control loop: worst lateness" in event.text for event in recording.events)


def test_stop_request_is_zero_within_a_tenth_of_a_second(tmp_path, report, prompt):
    with live_bench(tmp_path) as bench:
        front, _ = under_way(bench)
        asked = time.monotonic_ns()
        front.peer.send(Request("stop", "a test"))
        last = front.to_the_end(bench)
        assert (last.outcome, last.stop_confirmed) == ("aborted", True)
        assert "a test" in last.cause
        latency = zero_after(bench.truth(), asked)
        report("stop request to command 0", latency, "s")
        prompt(latency, 0.1, asked)
        assert the_recording(bench).outcome == "aborted"


def test_kill_9_of_the_controller(tmp_path, report, prompt):
    with live_bench(tmp_path) as bench:
        front, pid = under_way(bench)
        os.kill(pid, signal.SIGKILL)
        killed = time.monotonic_ns()
        bench.controllers[0].wait(15)
        assert at_rest(bench)
        latency = zero_after(bench.truth(), killed)
        report("kill -9 of the controller to release", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, killed)
        recording = the_recording(bench)
        assert (recording.outcome, recording.complete) == ("aborted", True)
        assert "controller" in recording.cause
        thrust = recording.first_of("thrust")
        assert thrust is not None
        assert thrust.time[-1] > recording.steps[-1].t_end
        front.peer.close()


def test_kill_9_of_the_recorder(tmp_path, report, prompt):
    with live_bench(tmp_path) as bench:
        front, pid = under_way(bench)
        rows_flushed_by = front.last.time
        os.kill(recorder_pid(pid), signal.SIGKILL)
        killed = time.monotonic_ns()
        last = front.to_the_end(bench)
        assert last.outcome in ("tripped", "aborted")
        assert "recorder" in last.cause
        latency = zero_after(bench.truth(), killed)
        report("kill -9 of the recorder to command 0", latency, "s")
        prompt(latency, WATCHDOG + TICK, killed)
        recording = the_recording(bench)
        assert not recording.complete
        thrust = recording.first_of("thrust")
        assert thrust is not None
        assert thrust.time[-1] > rows_flushed_by - 0.6
        (path,) = (bench.folder / "out").glob("*/T1.h5")
        CliRunner().invoke(recover_command, [str(path)], catch_exceptions=False)
        recovered = load(path.with_name("T1-recovered.h5"))
        assert recovered.outcome == last.outcome
        assert recovered.cause.startswith(last.cause), "the cause stands in the file too, once it is recovered"


def test_front_end_of_an_attended_run_is_gone(tmp_path, report, prompt):
    with live_bench(tmp_path) as bench:
        front, _ = under_way(bench, unattended=False)
        front.peer.close()
        left = time.monotonic_ns()
        bench.controllers[0].wait(15)
        latency = zero_after(bench.truth(), left)
        report("front end gone to command 0", latency, "s")
        prompt(latency, 0.1, left)
        recording = the_recording(bench)
        assert recording.complete
        assert "operator" in recording.cause


def test_lease_of_an_attended_run_lapses(tmp_path, report, prompt):
    """A console that is stopped (Ctrl+Z) or hangs keeps its socket and says nothing."""
    with live_bench(tmp_path) as bench:
        front, _ = under_way(bench, unattended=False)
        silent = time.monotonic_ns()
        bench.controllers[0].wait(15)
        latency = zero_after(bench.truth(), silent)
        report("front end silent to command 0", latency, "s")
        prompt(latency, 2.0 + 0.2, silent)
        assert "operator" in the_recording(bench).cause
        front.peer.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_signal_to_the_controller(tmp_path, report, prompt, number):
    with live_bench(tmp_path) as bench:
        front, pid = under_way(bench)
        os.kill(pid, number)
        sent = time.monotonic_ns()
        bench.controllers[0].wait(15)
        latency = zero_after(bench.truth(), sent)
        report(f"{number.name} to command 0", latency, "s")
        prompt(latency, 0.2, sent)
        assert number.name in the_recording(bench).cause
        front.peer.close()


def test_frozen_controller_is_stopped_by_the_device_and_does_not_go_on(tmp_path, report, prompt):
    with live_bench(tmp_path) as bench:
        front, pid = under_way(bench)
        os.kill(pid, signal.SIGSTOP)
        frozen = time.monotonic_ns()
        assert at_rest(bench)
        os.kill(pid, signal.SIGCONT)
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        latency = zero_after(bench.truth(), frozen)
        report("SIGSTOP of the controller to release", latency, "s")
        prompt(latency, WATCHDOG + TICK + SLACK, frozen)


@pytest.mark.parametrize(
    ("device", "allowed"), [("load_cell", PATIENCE + TICK + SLACK), ("motor", WATCHDOG + TICK + SLACK)]
)
def test_device_falls_silent(tmp_path, report, prompt, device, allowed):
    with live_bench(tmp_path) as bench:
        front, _ = under_way(bench)
        bench.tell("fault", device, "silent")
        fault = next(line for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert device in last.cause
        latency = zero_after(bench.truth(), fault["t_ns"])
        report(f"{device} silent to command 0", latency, "s")
        prompt(latency, allowed, fault["t_ns"])


def test_motor_without_an_effective_watchdog_is_refused(tmp_path):
    with live_bench(tmp_path, lambda text: text.replace("timeout = 0.5 ", "timeout = 0.0 ")) as bench:
        front = attach(bench.start(prove=True))
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert "watchdog" in last.cause
        assert at_rest(bench)


def test_unattended_run_goes_on_without_front_ends_and_is_attached_again(tmp_path):
    with live_bench(tmp_path) as bench:
        front, _ = under_way(bench, dwell=1.0)
        front.peer.send(Request("detach"))
        front.peer.close()
        again = FrontEnd(connect(Path(bench.runs[0].socket), "the controller"))
        seen = again.until(lambda s: True)
        first, last_before = seen.trace[0][0], seen.trace[-1][0]
        assert first < 0.5, "an attached console is given what came before it, from the beginning"
        assert last_before > seen.time - 0.5, "up to now"
        last = again.until(lambda s: s.state == "done")
        assert last.outcome == "completed"
        assert len(last.points) == 4
        bench.controllers[0].wait(15)
        again.peer.close()


def test_second_controller_on_the_same_bench_is_refused(tmp_path):
    with live_bench(tmp_path) as bench:
        front, _ = under_way(bench)
        with pytest.raises(Exception, match="in use by process"):
            bench.start()
        front.peer.close()
