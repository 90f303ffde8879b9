"""How late is the control loop while a console redraws beside it? At 50 Hz and at 1 kHz, on the simulated bench.

    python benchmarks/controller/loop_lateness.py [RATE ...]

The console runs in a terminal of its own (a pty) on the same machine. Figures are those that each recording carries
among its events, and the controller's processor time per tick.
"""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
import tempfile
import threading
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from rig.hdf5 import load
from rig.link.live_runs import Run
from tests.reliability.live import attach, live_bench

FIGURES = re.compile(r"worst lateness ([\d.]+) ms, p99 ([\d.]+) ms, p50 ([\d.]+) ms of (\d+) ticks")


def processor_time(pid: int) -> float:
    """User and system time of a process in s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def console(run: Run) -> tuple[subprocess.Popen[bytes], threading.Thread, int]:
    """`rig console` in a terminal that somebody looks at."""
    ours, theirs = pty.openpty()
    child = subprocess.Popen(
        [sys.executable, "-c", "from rig.cli import entry; entry()", "console", run.folder],
        stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True, env=os.environ | {"TERM": "xterm-256color"},
    )  # fmt: skip
    os.close(theirs)

    def look() -> None:
        try:
            while os.read(ours, 65_536):
                pass
        except OSError:
            return

    looker = threading.Thread(target=look)
    looker.start()
    return child, looker, ours


def at_rate(rate: float, text: str) -> str:
    return text.replace("loop_rate = 50.0", f"loop_rate = {rate:.1f}")


def trial(rate: float, *, watched: bool) -> tuple[float, ...]:
    """(p50, p99, worst) in ms, ticks, processor time per tick in ms."""
    with (
        tempfile.TemporaryDirectory() as folder,
        live_bench(Path(folder), edit_bench=partial(at_rate, rate)) as bench,
    ):
        run = bench.start()
        front = attach(run)
        front.until(lambda s: s.state == "preflight")
        screen = console(run) if watched else None
        began = front.until(lambda s: s.state == "hold").time
        before = processor_time(run.pid)
        last = front.until(lambda s: s.state == "stopping")
        spent, ticks = processor_time(run.pid) - before, (last.time - began) * rate
        front.until(lambda s: s.state == "done")
        front.peer.close()
        bench.controllers[0].wait(15)
        if screen:
            screen[0].terminate()
            screen[0].wait(10)
            screen[1].join(10)
            os.close(screen[2])
        (path,) = Path(run.folder).glob("*.h5")
        found = next(m for event in load(path).events if (m := FIGURES.search(event.text)))
        worst, p99, p50, count = (float(figure) for figure in found.groups())
        return p50, p99, worst, count, spent / ticks * 1e3


def main(rates: list[float]) -> None:
    """Print a table."""
    print("rate      console   p50 ms   p99 ms   worst ms   ticks   processor ms/tick (all threads)")
    for rate in rates:
        for watched in (False, True):
            p50, p99, worst, ticks, spent = trial(rate, watched=watched)
            shown = "yes" if watched else "no"
            print(
                f"{rate:5g} Hz  {shown:<7} {p50:8.2f} {p99:8.2f} {worst:10.2f} {ticks:7.0f}   {spent:.3f}", flush=True
            )


if __name__ == "__main__":
    main([float(word) for word in sys.argv[1:]] or [50.0, 1000.0])
