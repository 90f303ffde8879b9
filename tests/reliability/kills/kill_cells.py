"""One cell of the kill matrix: a campaign by `rig run` on a simulated bench, a signal to a process of it in a phase."""

from __future__ import annotations

import contextlib
import os
import random
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from rig.link.front_end_messages import Request
from rig.link.live_runs import Run, live_runs
from rig.link.processes import alive, started
from rig.link.sockets import connect
from rig.recording.facts import fact_of
from rig.recording.ledger import FILE_NAME
from tests.reliability.live import PROJECT, LiveBench, live_bench, patient
from tests.reliability.live_campaign import CAMPAIGN
from tests.rig.console.terminal import Terminal, on_terminal

PROCESSES: Final = ("controller", "recorder", "watcher", "console", "headless", "device")
SIGNALS: Final = ("TERM", "HUP", "INT2", "KILL", "STOP", "STOPCONT")
PHASES: Final = ("proof", "tare", "ramp", "hold", "flush", "pause", "mount", "between", "closing")
RIG: Final = "from rig.cli import entry; entry()"
TOGETHER: Final = 0.03
"""s between the two interrupts of INT2."""
FROZEN: Final = 2.5
"""s between STOP and CONT: more than any watchdog, lease or lapse lasts."""
SLACK: Final = 0.1
"""s of scheduling on a machine that is busy; what the metronome saw is taken off beside it."""
PATIENCE: Final = 60.0
"""s for a phase to come, and for a process to end before it counts as one that hangs."""
ALLOWED: Final = {
    "controller": {"TERM": 0.2, "HUP": 0.2, "INT2": 0.2},
    "recorder": {"STOP": 16.0, "STOPCONT": 16.0},
    "console": {"STOP": 2.3, "STOPCONT": 2.3},
    "headless": {"STOP": 2.3, "STOPCONT": 2.3},
}
"""s after the signal that the motor may be driven; elsewhere it is the device's own timeout and a tick of the loop. Of
a recorder that is stopped the loop knows after 15 s without a flush, of a front end when its lease of 2 s is over."""


class NotBegun(Exception):
    """The phase never came: nothing was tried."""


@dataclass(frozen=True)
class Cell:
    """What became of it."""

    process: str
    signal: str
    phase: str
    outcome: str
    """Of the campaign by its ledger; `-`: it says nothing of its end."""
    driven: float
    """s after the signal (after CONT of a bench) until the motor was driven for the last time; 0: it was not."""
    at_rest: bool
    files: str
    """How each recording was found: `closed`, `open` (read as it stands, and recovered) or why it can't be read."""
    hang: str
    """Processes that did not end."""
    cause: str = ""
    faults: tuple[str, ...] = ()
    """What must not be; empty: it is good."""


@dataclass
class Live:
    """A campaign that is running."""

    bench: LiveBench
    front: subprocess.Popen[Any]
    folder: Path
    run: Run
    terminal: Terminal | None
    pids: dict[str, tuple[int, str]] = field(default_factory=dict)
    """Of each process: its number and when it was started."""

    def facts(self) -> list[dict[str, Any]]:
        path = self.folder / FILE_NAME
        lines = path.read_bytes().split(b"\n")[:-1] if path.exists() else []
        return [dict(fact_of(line)) for line in lines]

    def until(self, wanted: Callable[[], bool], what: str, pause: float = 0.005) -> None:
        end = time.monotonic() + PATIENCE
        while not wanted():
            if time.monotonic() > end or (self.front.poll() is not None and not alive(self.run.pid, self.run.started)):
                raise NotBegun(f"{what} never came")
            waits = self.terminal is not None and "start" not in {fact["fact"] for fact in self.facts()}
            if self.terminal is not None and waits:
                self.terminal.press(b"\x1b[15~")  # F5, as an operator who waits
            select.select([], [], [], 0.2 if waits else pause)

    def alive(self, name: str) -> bool:
        if name == self.front_name:
            return self.front.poll() is None
        return alive(*self.pids[name])

    @property
    def front_name(self) -> str:
        return "headless" if self.terminal is None else "console"


def edited_bench(text: str) -> str:
    """The mount takes a second: a crane works."""
    shell = 'command = ["sh", "-c", "sleep 1; exec {python} -m sim_devices mount {bench_dir}/ports/control {thruster}"]'
    start = text.index("command = [")
    return patient(text[:start] + shell + text[text.index("\n", start) :])


def campaign_text() -> str:
    text = CAMPAIGN.format(unattended="false", prove="true", dwell=1.2, thrusters='["T1"]')
    return text.replace("voltages = [10.0, -10.0, 6.0, -6.0]", "voltages = [10.0]")


@contextlib.contextmanager
def campaign(folder: Path, *, console: bool) -> Iterator[Live]:
    """`rig run` on a bench of its own, as soon as its controller is there."""
    with contextlib.ExitStack() as stack:
        bench = stack.enter_context(live_bench(folder, edit_bench=edited_bench))
        (folder / "campaign.toml").write_text(campaign_text())
        words = ["run", str(folder / "campaign.toml"), "--output", str(folder / "out"), "--no-report"]
        terminal = None
        if console:
            front, terminal = stack.enter_context(on_terminal(RIG, *words))
        else:
            log = stack.enter_context((folder / "headless.log").open("wb"))
            front = subprocess.Popen(
                [sys.executable, "-c", RIG, *words, "--headless"], cwd=PROJECT, stdin=subprocess.DEVNULL, stdout=log,
                stderr=log, start_new_session=True,
            )  # fmt: skip
        try:
            run = _controller_of(folder, front)
            live = Live(bench, front, Path(run.folder), run, terminal)
            live.pids = {"controller": (run.pid, run.started), "device": _known(bench.process.pid)}
            live.until(lambda: _children(live), "recorder and watcher")
            stack.callback(_end_all, live)
            yield live
        finally:
            front.kill()
            front.wait()


def _controller_of(folder: Path, front: subprocess.Popen[Any]) -> Run:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and front.poll() is None:
        for run in live_runs():
            if Path(run.folder).is_relative_to(folder):
                return run
        select.select([], [], [], 0.05)
    raise NotBegun("the controller never came")


def _known(pid: int) -> tuple[int, str]:
    return pid, started(pid)


def _children(live: Live) -> bool:
    with contextlib.suppress(OSError):
        for pid in map(int, Path(f"/proc/{live.run.pid}/task/{live.run.pid}/children").read_text().split()):
            words = Path(f"/proc/{pid}/cmdline").read_text()
            for name, module in (("recorder", "rig.recording.recorder"), ("watcher", "rig.watch.watcher")):
                if module in words:
                    live.pids[name] = _known(pid)
    return {"recorder", "watcher"} <= live.pids.keys()


def _end_all(live: Live) -> None:
    for pid, since in live.pids.values():
        if pid != live.bench.process.pid and alive(pid, since):
            os.kill(pid, signal.SIGKILL)
    with contextlib.suppress(ProcessLookupError):
        live.bench.process.send_signal(signal.SIGCONT)


def reach(live: Live, phase: str, chance: random.Random) -> None:
    """Return when the campaign is there. Raises NotBegun."""

    def told(fact: str, index: int | None = None) -> Callable[[], bool]:
        return lambda: any(f["fact"] == fact and index in (None, f.get("index")) for f in live.facts())

    where: dict[str, tuple[Callable[[], bool], float]] = {
        "mount": (told("start"), 0.8), "proof": (told("run_start"), 1.5), "tare": (told("step", -1), 0.8),
        "ramp": (told("step", 0), 0.3), "hold": (told("step", 1), 0.8), "flush": (told("step", 1), 0.3),
        "pause": (told("step", 1), 0.3), "between": (told("step", 2), 0.0), "closing": (told("step", 5), 0.5),
    }  # fmt: skip
    wanted, spread = where[phase]
    live.until(wanted, phase)
    select.select([], [], [], chance.uniform(0.0, spread))
    if phase == "flush":
        (file,) = live.folder.glob("*.h5")
        before = file.stat().st_mtime_ns
        live.until(lambda: file.stat().st_mtime_ns != before, "a flush", 0.0005)
    if phase == "pause":
        peer = connect(Path(live.run.socket), "the controller")
        peer.send(Request("pause"))
        select.select([], [], [], 0.4)
        peer.close()


def strike(live: Live, process: str, name: str) -> int:
    """Send the signal; returns when, in ns: of a bench that was stopped, when it went on."""
    pid = live.front.pid if process == live.front_name else live.pids[process][0]
    at = time.monotonic_ns()
    if name == "INT2":
        os.kill(pid, signal.SIGINT)
        select.select([], [], [], TOGETHER)
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGINT)
    else:
        os.kill(pid, getattr(signal, f"SIG{name.removesuffix('CONT')}"))
    if name == "STOPCONT":
        select.select([], [], [], FROZEN)
        with contextlib.suppress(ProcessLookupError):  # who waited for it has ended it by now
            os.kill(pid, signal.SIGCONT)
        at = time.monotonic_ns() if process == "device" else at
    return at
