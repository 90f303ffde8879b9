"""A simulated bench in its own process, a controller on it, and the truth log that tells what the motor really did."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rig.hdf5 import RecordingFile, load
from rig.link.front_end_messages import Request, Snapshot
from rig.link.live_runs import Run
from rig.link.sockets import Peer, connect
from rig.operate.run import start_controller
from sim_devices.wires.ports import ask
from tests.reliability.live_campaign import CAMPAIGN

PROJECT = Path(__file__).parents[2]
WATCHDOG = 0.5
"""s, the device's own command timeout in benches/simulated/world.toml."""
TICK = 0.02
"""s, loop period of benches/simulated/bench.toml."""
PATIENCE = 0.6
"""s, allowed age of a sample; 0.2 s is the default, tried in virtual time in tests/rig."""
NOT_BEGUN = "the run did not get where the test begins"
"""Begins the message of a test that could not try its promise: the Makefile begins that test once more."""
SLACK = 0.03
"""s of scheduling noise allowed on a loaded two-core machine."""
NOT_PROVED = """
[overrides]
"campaign.prove_watchdog" = "a test of something else"
"""


@dataclass
class LiveBench:
    """Bench files in `folder`; the bench runs until the context ends."""

    folder: Path
    process: subprocess.Popen[str]
    runs: list[Run] = field(default_factory=list)
    controllers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def truth(self) -> list[dict[str, Any]]:
        lines = (self.folder / "ports" / "truth.jsonl").read_text().split("\n")
        return [json.loads(line) for line in lines[:-1]]

    def start(
        self,
        *,
        unattended: bool = True,
        prove: bool = False,
        dwell: float = 2.0,
        thrusters: tuple[str, ...] = ("T1",),
        **names: str,
    ) -> Run:
        """A controller process on this bench, listening."""
        text = CAMPAIGN.format(
            unattended=str(unattended).lower(), prove=str(prove).lower(), dwell=dwell, thrusters=json.dumps(thrusters)
        )
        for old, new in names.items():
            text = text.replace(old, new)
        text += "" if prove else NOT_PROVED
        campaign = self.folder / "campaign.toml"
        campaign.write_text(text)
        folder = self.folder / "out" / f"run-{len(self.runs)}"
        folder.mkdir(parents=True)
        run, process = start_controller(campaign, folder, ())
        self.runs.append(run)
        self.controllers.append(process)
        return run

    def until_held(self, volts: float, seconds: float, timeout: float = 40.0) -> None:
        """Wait until the drive has had the same command of `volts` for so many `seconds`."""
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            states = self._newest_states(seconds)
            if states and all(abs((state["command"] or 0.0) - volts) < 0.01 for state in states):
                return
            select.select([], [], [], 0.05)
        raise AssertionError(f"{volts} V were not held within {timeout} s")

    def _newest_states(self, seconds: float) -> list[dict[str, Any]]:
        """State lines of that many seconds up to now, read from the log's end: to read it all is work that disturbs."""
        with (self.folder / "ports" / "truth.jsonl").open("rb") as file:
            file.seek(-min(file.seek(0, 2), round(seconds * 100 + 50) * 300), 2)  # 100 lines/s of < 300 bytes
            lines = file.read().split(b"\n")[1:-1]
        states = [state for state in map(json.loads, lines) if state["event"] == "state"]
        since = time.monotonic_ns() - round(seconds * 1e9)
        return [state for state in states if state["t_ns"] >= since]

    def tell(self, *words: str) -> None:
        """Script a fault over the bench's control port."""
        answer = ask(self.folder / "ports" / "control", " ".join(words))
        assert answer.startswith("ok "), answer


def unchanged(text: str) -> str:
    return text


def patient(text: str) -> str:
    """`whole` without flow meter and thermometer, for whose five slow rows every preflight would wait (2.5 s)."""
    slow = text.index("[devices.flow]")
    return whole(text[:slow] + text[text.index("[limits", slow) :])


def whole(text: str) -> str:
    """A bench file whose samples may be `PATIENCE` late: the machine that the tests run on is not tried here."""
    for limit in ("min = -300.0 ", "max = 40.0 "):  # of load_cell.thrust, of motor.current
        assert limit in text
        text = text.replace(limit, f"max_age = {PATIENCE}\n{limit}")
    return text


@contextmanager
def live_bench(
    folder: Path, edit: Callable[[str], str] = unchanged, edit_bench: Callable[[str], str] = patient
) -> Iterator[LiveBench]:
    """Start the bench of benches/simulated with its world and bench files edited; everything is ended at the end."""
    (folder / "bench.toml").write_text(edit_bench((PROJECT / "benches/simulated/bench.toml").read_text()))
    world = folder / "world.toml"
    world.write_text(edit((PROJECT / "benches/simulated/world.toml").read_text()))
    process = subprocess.Popen(
        [sys.executable, "-m", "sim_devices", str(world)], stdout=subprocess.PIPE, text=True, cwd=PROJECT
    )
    assert process.stdout is not None
    bench = LiveBench(folder, process)
    try:
        for line in process.stdout:
            if line.strip() == "ready":
                break
        yield bench
    finally:
        for controller in bench.controllers:
            controller.kill()
            controller.wait()
        process.terminate()
        process.wait(10)
        process.stdout.close()


@dataclass
class FrontEnd:
    """A front end that attends and never draws."""

    peer: Peer
    last: Snapshot | None = None

    def until(self, wanted: Callable[[Snapshot], bool], timeout: float = 40.0) -> Snapshot:
        """Follow the run, start it when it waits for that, until a snapshot is as wanted.

        A preflight that a stall of this machine has failed is started again a second later, as an operator would.
        """
        deadline = time.monotonic() + timeout
        ask_at = 0.0
        while time.monotonic() < deadline and not self.peer.closed:
            self.peer.send(Request("lease"))
            select.select([self.peer], [], [], 0.1)
            for message in self.peer.receive():
                assert isinstance(message, Snapshot)
                self.last = message
                if wanted(message):
                    return message
                if message.state == "preflight" and time.monotonic() >= ask_at and len(message.checks) > 5:
                    ask_at = time.monotonic() + 1.0
                    self.peer.send(Request("start"))
        closed = self.peer.closed
        self.peer.close()
        raise AssertionError(f"not reached within {timeout} s; closed before: {closed}; {_last(self.last)}")

    def begin(self, wanted: Callable[[Snapshot], bool], timeout: float = 40.0) -> Snapshot:
        """`until`, before the promise is tried."""
        try:
            return self.until(wanted, timeout)
        except AssertionError as error:
            raise AssertionError(f"{NOT_BEGUN}: {error}") from error

    def to_the_end(self, bench: LiveBench) -> Snapshot:
        """Follow the newest run until it is done, and leave: its controller shows the end as long as somebody is there.

        Returns once that process has ended; its files are closed then.
        """
        last = self.until(lambda s: s.state == "done")
        self.peer.close()
        bench.controllers[-1].wait(15)
        return last


def _last(snapshot: Snapshot | None) -> str:
    if snapshot is None:
        return "no snapshot came"
    said = "; ".join(line.text for line in snapshot.log[-6:])
    return f"last state {snapshot.state!r}, outcome {snapshot.outcome!r} {snapshot.cause!r}; log: {said}"


def attach(run: Run) -> FrontEnd:
    return FrontEnd(connect(Path(run.socket), "the controller"))


def turning(volts: float, seconds: float = 0.5) -> Callable[[Snapshot], bool]:
    """Has a hold of that voltage lasted so many `seconds`, and has the propeller answered?"""

    def wanted(s: Snapshot) -> bool:
        held = s.progress is not None and s.progress.step_elapsed > seconds
        return s.state == "hold" and abs(s.command - volts) < 0.01 and held

    return wanted


def zero_after(truth: list[dict[str, Any]], t_ns: int) -> float:
    """s from `t_ns` until the drive no longer drives: command 0, or released. Fails when it drives again later."""
    changes = [line for line in truth if line["event"] in ("command", "timeout") and line["t_ns"] >= t_ns]
    zero = next(line for line in changes if line["event"] == "timeout" or line["value"] == 0)
    driven_again = [line for line in changes if line["t_ns"] > zero["t_ns"] and line.get("value")]
    assert not driven_again, f"the motor was driven again: {driven_again[:3]}"
    return (zero["t_ns"] - t_ns) * 1e-9


@dataclass(frozen=True)
class Killed:
    """What came of one kill -9."""

    state: str
    """Of the campaign when it was killed."""
    t_ns: int
    """When."""
    release: float
    """s until the motor was no longer driven."""
    rested: bool
    outcome: str
    complete: bool
    lost: float
    """s of thrust samples that were there and are not in the file."""


def closed(run: Run, timeout: float = 5.0) -> RecordingFile:
    """The one recording of a run whose controller is gone, once the recorder has closed it, or as it is by then."""
    (path,) = Path(run.folder).glob("*.h5")
    deadline = time.monotonic() + timeout
    while not (recording := load(path)).complete and time.monotonic() < deadline:
        select.select([], [], [], 0.1)
    return recording


def kill_once(bench: LiveBench, after: float) -> Killed:
    """Start a run and kill -9 its controller `after` s after its first tare began."""
    run = bench.start(dwell=1.0)
    front = attach(run)
    front.begin(lambda s: s.state == "tare")
    end = time.monotonic() + after
    seen = front.until(lambda s: time.monotonic() >= end or s.state == "done")
    os.kill(run.pid, signal.SIGKILL)
    t_ns = time.monotonic_ns()
    bench.controllers[-1].wait(15)
    front.peer.close()
    rested = at_rest(bench)
    recording = closed(run)
    thrust = recording.first_of("thrust")
    recorded = float(thrust.time[-1]) if thrust is not None else 0.0
    lost = max(seen.time - recorded, 0.0)
    select.select([], [], [], max(t_ns * 1e-9 + 2 * WATCHDOG - time.monotonic(), 0.0))  # a motor at rest is let go too
    release = zero_after(bench.truth(), t_ns)
    return Killed(seen.state, t_ns, release, rested, recording.outcome, recording.complete, lost)


def at_rest(bench: LiveBench, timeout: float = 5.0) -> bool:
    """Does the rotor come to rest (|n| < 0.5 rev/s) by the truth log?"""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        states = [line for line in bench.truth() if line["event"] == "state"]
        if abs(states[-1]["n"]) < 0.5:
            return True
        select.select([], [], [], 0.1)
    return False
