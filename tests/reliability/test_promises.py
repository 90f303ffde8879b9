"""More promises of docs/reliability.md, each measured on a simulated bench in another process."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rig.hdf5 import load
from rig.link.front_end_messages import Request
from rig.recording.ledger import read
from tests.reliability.live import PROJECT, SLACK, TICK, WATCHDOG, at_rest, attach, kill_once, live_bench, turning

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(150)]


def test_watchdog_longer_than_the_limit_is_refused_at_preflight(tmp_path):
    """Promise 9."""

    def longer(text: str) -> str:
        return text.replace("watchdog_timeout = 0.5", "watchdog_timeout = 1.5")

    with live_bench(tmp_path, edit_bench=longer) as bench:
        front = attach(bench.start())
        seen = front.until(lambda s: any("not started: watchdog" in line.text for line in s.log))
        assert seen.state == "preflight"
        front.peer.send(Request("stop", "a test"))
        front.until(lambda s: s.state == "done")
        front.peer.close()
        assert all(not line.get("value") for line in bench.truth() if line["event"] == "command")


def test_motor_that_ignores_stop_is_never_called_idle(tmp_path):
    """Promise 11: neither command 0 nor release is obeyed, and the device's own watchdog is off."""
    with live_bench(tmp_path, lambda text: text.replace("timeout = 0.5 ", "timeout = 0.0 ")) as bench:
        front = attach(bench.start(dwell=15.0))  # still this hold when the fault arrives, however late
        front.begin(turning(10.0))
        bench.tell("fault", "motor", "ignores_commands")
        front.peer.send(Request("stop", "a test"))
        last = front.to_the_end(bench)
        assert last.stop_confirmed is False
        assert any("STOP NOT CONFIRMED" in line.text and line.level == "error" for line in last.log)
        (path,) = Path(bench.runs[0].folder).glob("*.h5")
        assert any("STOP NOT CONFIRMED" in event.text for event in load(path).events)


@pytest.mark.parametrize(
    ("device", "fault", "amount", "cause", "within"),
    [
        ("load_cell", "frozen", (), "frozen", 2.0 + 0.5),
        ("load_cell", "overload", (), "load_cell.thrust", 0.3),
        ("load_cell", "corrupted", ("0.3",), "load_cell", 2.0 + 0.5),
        ("load_cell", "slow", (), "load_cell", 2.0 + 0.5),
    ],
)
def test_sensor_that_lies(tmp_path, report, prompt, device, fault, amount, cause, within):
    """Promise 8: each is found within its declared time, by the truth log."""
    with live_bench(tmp_path) as bench:
        front = attach(bench.start(dwell=4.0))
        front.begin(turning(10.0))
        bench.tell("fault", device, fault, *amount)
        begun = next(line for line in reversed(bench.truth()) if line["event"] == "fault")
        last = front.to_the_end(bench)
        assert last.outcome == "tripped"
        assert cause in last.cause
        zero = next(
            line
            for line in bench.truth()
            if line["t_ns"] >= begun["t_ns"] and line["event"] == "command" and line["value"] == 0
        )
        latency = (zero["t_ns"] - begun["t_ns"]) * 1e-9
        report(f"{device} {fault} to command 0", latency, "s")
        prompt(latency, within, begun["t_ns"])


def test_kill_9_at_random_instants(tmp_path, report, prompt):
    """Promise 1; twenty and more of them: benchmarks/controller/kill_minus_9.py."""
    chance, worst = random.Random(15), 0.0
    with live_bench(tmp_path) as bench:
        for _ in range(5):
            killed = kill_once(bench, chance.uniform(0.0, 6.0))
            worst = max(worst, killed.release)
            prompt(killed.release, WATCHDOG + TICK + SLACK, killed.t_ns)
            assert killed.rested
            assert (killed.outcome, killed.complete) == ("aborted", True)
    report("kill -9 at 5 random instants: worst time to release", worst, "s")


def test_resume_after_kill_9_gives_what_an_uninterrupted_campaign_gives(tmp_path):
    """Promise 22; in virtual time, with many kills: tests/rig/operate/test_kill_and_resume.py."""
    with live_bench(tmp_path) as bench:
        front = attach(bench.start(thrusters=("T1", "T3"), dwell=0.6))
        front.begin(lambda s: s.thruster == "T3" and s.state == "hold" and len(s.points) == 2, timeout=60.0)
        os.kill(bench.runs[0].pid, signal.SIGKILL)
        front.peer.close()
        bench.controllers[0].wait(15)
        assert at_rest(bench)
        folder = Path(bench.runs[0].folder)
        words = [sys.executable, "-c", "from rig.cli import entry; entry()", "resume", str(folder), "--headless"]
        resumed = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True, timeout=80, check=False)
        assert resumed.returncode == 0, resumed.stderr
        assert "finished: T1; to do: T3 from step" in resumed.stdout
        ends = [fact for fact in read(folder) if fact["fact"] == "run_end"]
        assert [(end["thruster"], end["outcome"]) for end in ends] == [("T1", "completed"), ("T3", "completed")]
        assert Path(ends[1]["recording"]).name == "T3-2.h5"
        whole, cut, rest = (load(folder / name) for name in ("T1.h5", "T3.h5", "T3-2.h5"))
        assert any("attempt 2 of T3: it goes on at step" in event.text for event in rest.events)
        assert (cut.outcome, rest.attributes["continues"]) == ("aborted", cut.recording_id), "the cut one is kept"
        holds = [(s.index, s.command_voltage) for s in whole.steps if s.phase == "hold"]
        assert [(s.index, s.command_voltage) for s in (*cut.steps, *rest.steps) if s.phase == "hold"] == holds
        (answer,) = [one for one in json.loads((folder / "fits.json").read_text())["fits"] if one["thruster"] == "T3"]
        assert answer["recordings"] == [cut.recording_id, rest.recording_id], "one fit over both parts"
        again = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True, timeout=30, check=False)
        assert again.returncode == 2
        assert "nothing to resume" in again.stderr


def test_shutting_down_takes_no_longer_than_it_must(tmp_path, report):
    with live_bench(tmp_path) as bench:
        front = attach(bench.start())
        front.begin(lambda s: s.state == "tare")
        front.peer.send(Request("stop", "a test"))
        front.until(lambda s: s.state == "done")
        front.peer.close()
        done = time.monotonic()
        assert bench.controllers[0].wait(15) == 0
        report("done to the end of the controller", time.monotonic() - done, "s")
