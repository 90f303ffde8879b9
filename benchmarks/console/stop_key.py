"""From the stop key to command 0 at the motor, on every screen of the console, many times.

    python benchmarks/console/stop_key.py [--presses 100] [--screen NAME ...] [--size 160x48] [--json OUT]

`rig console` on a pseudo-terminal, a real controller and recorder, a simulated bench in a process of its own, whose
truth log has the clock of this machine. For each page, each dialog (the note with text in it), and the moment in which
one opens: the key's bytes are written to the terminal at a random instant of a hold, F9 and Ctrl+C in turn, while the
plots are drawn again and the recorder stands still as in a flush that takes two seconds. The run begins again by itself
(`begins_again.py`). Three latencies, all from just before that write: to the instant at which the controller has
handed 0 to the motor's driver; the same less what held up an idle process meanwhile (net); to the command 0 in the
truth log, with which the bench's process is late on a busy machine as well. About three seconds a press on a quiet one.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from benchmarks.console.bench import Truth, running
from benchmarks.console.screens import Screen, screens
from rig.errors import LinkError
from rig.link.live_runs import Run
from tests.reliability.machine.metronome import metronome, stalled
from tests.reliability.test_console_stop import CTRL_C, F9, RIG
from tests.reliability.test_motor_stops import recorder_pid
from tests.rig.console.terminal import Terminal, on_terminal

PROMISE = 0.1
"""s, p99 of 100 presses (docs/reliability.md, promise 4)."""
MOST_BENCHES = 8
FLUSH = 2.0
"""s for which the recorder stands still around a press at most; it goes on as soon as command 0 has come."""


Latency = tuple[float, float, float]
"""s, to 0 at the driver, the same less the machine's own stalls, and to 0 in the truth log."""


@dataclass(frozen=True)
class Row:
    """One screen: ms."""

    screen: str
    presses: int
    median: float
    p99: float
    worst: float
    """To 0 at the motor's driver;"""
    net_median: float
    net_p99: float
    net_worst: float
    """the same less what held up an idle process;"""
    truth_median: float
    truth_p99: float
    truth_worst: float
    """in the truth log."""
    load: float


@contextmanager
def flush_of_two_seconds(recorder: int) -> Iterator[None]:
    """The recorder writes nothing, answers nothing and takes nothing."""
    os.kill(recorder, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(recorder, signal.SIGCONT)


def press(terminal: Terminal, truth: Truth, recorder: int, screen: Screen, key: bytes, idle: Path) -> Latency | None:
    """s from the key to command 0; None when the motor was not driven at that instant (a trip came before)."""
    truth.until_driven()
    with flush_of_two_seconds(recorder):
        select.select([], [], [], random.uniform(0.05, 0.35))
        pressed = time.monotonic_ns()
        terminal.press(screen.with_the_key + key)
        latency = truth.zero_after(pressed, FLUSH)
    if screen.closes:
        terminal.press(screen.closes)
    if latency is None:
        return None
    sent = truth.sent_after(pressed)
    return sent, sent - stalled(idle, pressed, pressed + round(1e9 * sent)), latency


def on_screen(screen: Screen, presses: int, size: tuple[int, int]) -> list[Latency]:
    """s of each press. Where the guard has ended a run, for this machine is busy, the bench is started once more."""
    found: list[Latency] = []
    for _ in range(MOST_BENCHES):
        try:
            _on_one_bench(screen, presses, size, found)
        except (TimeoutError, AssertionError, LinkError) as error:
            print(f"{screen.name}: begun again after {len(found)} presses: {str(error)[:100]}", file=sys.stderr)
        if len(found) >= presses:
            return found
    raise TimeoutError(f"{screen.name}: {len(found)} of {presses} presses on {MOST_BENCHES} benches: a busy machine")


def _on_one_bench(screen: Screen, presses: int, size: tuple[int, int], found: list[Latency]) -> None:
    with (
        TemporaryDirectory() as folder,
        metronome(idle := Path(folder) / "idle"),
        running(Path(folder)) as (run, truth, _),
        console(run, size) as terminal,
    ):
        truth.until_driven()
        recorder = recorder_pid(run.pid)
        terminal.press(screen.opens)
        select.select([], [], [], 1.0)
        while len(found) < presses:
            latency = press(terminal, truth, recorder, screen, F9 if len(found) % 2 else CTRL_C, idle)
            found += [] if latency is None else [latency]


@contextmanager
def console(run: Run, size: tuple[int, int]) -> Iterator[Terminal]:
    """`rig console` on that run, which has drawn its key line."""
    with on_terminal(RIG, "console", run.folder, "--no-report", size=size) as (process, terminal):
        try:
            terminal.until(b"STOP")
            select.select([], [], [], 1.0)
            yield terminal
        finally:
            _end(process)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(10.0)
    except subprocess.TimeoutExpired:
        process.kill()


def row_of(name: str, seconds: Sequence[Latency]) -> Row:
    columns = 1e3 * np.quantile(seconds, [0.5, 0.99, 1.0], axis=0)
    sent, net, truth = ([round(float(value), 1) for value in column] for column in columns.T)
    return Row(name, len(seconds), *sent, *net, *truth, round(os.getloadavg()[0], 1))


def as_line(row: Row) -> str:
    return f"| {' | '.join(map(str, asdict(row).values()))} |"


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--presses", type=int, default=100, help="of each screen (default: 100)")
    parser.add_argument("--screen", action="append", choices=list(screens()), help="only this one; may be repeated")
    parser.add_argument("--size", default="160x48", help="columns x rows of the terminal (default: 160x48)")
    parser.add_argument("--json", type=Path, help="write the rows there as well")
    return parser.parse_args()


def main() -> int:
    """1 when a screen breaks the promise."""
    asked = arguments()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # bench and controller end with this process
    columns, rows = map(int, asked.size.split("x"))
    begun, found, every = time.monotonic(), list[Row](), list[Latency]()
    print(f"key to command 0 in ms, terminal of {asked.size}, load {os.getloadavg()[0]:.1f} before\n")
    print("| screen | presses | median | p99 | worst | net median | p99 | worst | truth median | p99 | worst | load |")
    print("|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for name, screen in screens().items():
        if asked.screen and name not in asked.screen:
            continue
        seconds = on_screen(screen, asked.presses, (columns, rows))
        every += seconds
        found.append(row_of(name, seconds))
        print(as_line(found[-1]), flush=True)
        if asked.json:
            asked.json.write_text(json.dumps([asdict(row) for row in found], indent=1) + "\n", encoding="utf-8")
    print(as_line(row_of("all", every)))
    print(f"\n{len(every)} presses in {time.monotonic() - begun:.0f} s; promise: p99 <= {1e3 * PROMISE:.0f} ms")
    return int(any(row.p99 > 1e3 * PROMISE for row in found))


if __name__ == "__main__":
    sys.exit(main())
