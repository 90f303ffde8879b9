"""The operator's console as a process on a real terminal, a real controller, a bench in a third process: what a key, a
kill or a dropped line does to the motor, by the bench's truth log."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.hdf5 import load
from rig.link.live_runs import Run
from tests.reliability.live import LiveBench, at_rest, live_bench, zero_after
from tests.reliability.page.measured import FULL
from tests.reliability.test_motor_stops import recorder_pid
from tests.rig.console.terminal import Terminal, on_terminal

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(90)]

F5, F9, CTRL_C = b"\x1b[15~", b"\x1b[20~", b"\x03"
RIG = "from rig.cli import entry; entry()"
ENOUGH = 2.3
"""s: the lease of a console that is there and silent lasts 2 s."""


@contextmanager
def at_console(bench: LiveBench, run: Run) -> Iterator[tuple[subprocess.Popen[bytes], Terminal]]:
    """`rig console` on that run; it has started the motor, which holds 10 V."""
    with on_terminal(RIG, "console", run.folder, "--no-report") as (process, terminal):
        start_from(terminal, bench)
        yield process, terminal


def start_from(terminal: Terminal, bench: LiveBench) -> None:
    """Press the start key once the preflight has passed, and wait until the motor holds 10 V."""
    terminal.until(b"Press F5 to start")
    terminal.press(F5)
    bench.until_held(10.0, 0.5)


def ended(bench: LiveBench, run: Run) -> tuple[str, str]:
    """Outcome and cause in the recording, once the controller has ended; the file is whole, the motor at rest."""
    bench.controllers[-1].wait(15)
    recording = load(Path(run.folder) / "T1.h5")
    assert recording.complete
    assert at_rest(bench)
    return recording.outcome, recording.cause


def leave(process: subprocess.Popen[bytes], terminal: Terminal) -> None:
    """Close a dialog, if there is one, and go."""
    terminal.press(b"\r")
    while process.poll() is None:
        terminal.press(b"d")
        select.select([], [], [], 0.3)


@contextmanager
def slow_disk(run: Run, slow: bool) -> Iterator[None]:
    """Where `slow`, the recorder stands still as in a flush that blocks, and goes on afterwards."""
    recorder = recorder_pid(run.pid)
    if slow:
        os.kill(recorder, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(recorder, signal.SIGCONT)


PLACES = {
    "1": b"1",
    "2": b"2",
    "3": b"3",
    "4": b"4",
    "5": b"5",
    "a note": b"n",
    "the leave dialog": b"d",
    "at once": b"n",
}
PRESSES = (
    [(place, slow, key) for place in PLACES for slow in (False, True) for key in (F9, CTRL_C) for _ in range(3)]
    if FULL
    else [("1", False, F9), ("2", False, CTRL_C), ("at once", False, CTRL_C), ("the leave dialog", True, F9)]
)
"""Where the key is pressed: a page by its number, a focused text field, a modal dialog, in one write with the key that
opens the text field; whether the disk is slow meanwhile."""


@pytest.mark.parametrize(("place", "slow", "key"), PRESSES)
def test_stop_key_to_command_0(tmp_path, report, prompt, place, slow, key):
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=False, dwell=20.0)
        with at_console(bench, run) as (process, terminal):
            if place != "at once":
                terminal.press(PLACES[place])
                select.select([], [], [], 0.3)
            with slow_disk(run, slow):
                pressed = time.monotonic_ns()
                terminal.press((PLACES[place] if place == "at once" else b"") + key)
                bench.until_held(0.0, 0.3)
            terminal.until(b"ABORTED")
            leave(process, terminal)
        latency = zero_after(bench.truth(), pressed)
        report("stop key of a console to command 0" + (", disk slow" if slow else ""), latency, "s")
        prompt(latency, 0.13, pressed)
        assert ended(bench, run) == ("aborted", "stopped by console")
        assert process.returncode == 1


def gone(
    bench: LiveBench, run: Run, prompt: Callable[[float, float, int], None], since_ns: int, allowed: float
) -> tuple[float, str]:
    """s from `since_ns` to command 0, and the cause in the recording, of an attended run that lost its console."""
    outcome, cause = ended(bench, run)
    latency = zero_after(bench.truth(), since_ns)
    assert outcome == "tripped"
    prompt(latency, allowed, since_ns)
    return latency, cause


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP], ids=lambda number: number.name)
def test_console_of_an_attended_run_is_killed(tmp_path, report, prompt, number):
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=False, dwell=20.0)
        with at_console(bench, run) as (process, _):
            killed = time.monotonic_ns()
            process.send_signal(number)
        latency, cause = gone(bench, run, prompt, killed, allowed=0.5)
        report(f"{number.name} of the console to command 0", latency, "s")
        assert "operator" in cause
        assert process.returncode == (-number if number == signal.SIGKILL else 128 + number)


def test_terminal_of_an_attended_run_is_closed(tmp_path, report, prompt):
    """As a window that is closed or an ssh line that drops: the kernel hangs up, the console goes."""
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=False, dwell=20.0)
        with at_console(bench, run) as (_, terminal):
            closed = time.monotonic_ns()
            terminal.close()
        latency, cause = gone(bench, run, prompt, closed, allowed=ENOUGH)
        report("terminal of the console closed to command 0", latency, "s")
        assert "operator" in cause


def test_frozen_console_of_an_attended_run(tmp_path, report, prompt):
    """Stopped by Ctrl+Z in its shell, or hanging: its socket stays open and it says nothing."""
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=False, dwell=20.0)
        with at_console(bench, run) as (process, _):
            frozen = time.monotonic_ns()
            process.send_signal(signal.SIGSTOP)
            latency, cause = gone(bench, run, prompt, frozen, allowed=ENOUGH)
            process.kill()
        report("console frozen to command 0", latency, "s")
        assert "operator" in cause


def test_console_leaves_an_unattended_run_and_another_comes(tmp_path):
    """Detach, attach again, the table at the end from whoever is there; exit status 0 for both."""
    with live_bench(tmp_path) as bench:
        run = bench.start(unattended=True, dwell=1.0)
        with at_console(bench, run) as (first, terminal):
            terminal.press(b"d")
            terminal.until(b"Leave, campaign goes on")
            terminal.press(b"\t\r")
            terminal.until(b"attach again with: rig console")
        assert first.returncode == 0
        with on_terminal(RIG, "console", run.folder, "--no-report") as (second, terminal):
            terminal.until(b"COMPLETED")
            terminal.press(b"d")
            terminal.until(b"recordings, fits and logs")
        assert second.returncode == 0
        assert "chi2/dof" in terminal.lines
        assert ended(bench, run) == ("completed", "")
