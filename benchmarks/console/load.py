"""Four hours of a campaign of eight channels at 1 kHz on one console: how fast it draws, and what it keeps.

    python benchmarks/console/load.py [--hours 4] [--minutes 6] [--still 1] [--size 160x48] [--page 1] [--json OUT]

`rig console` on a pseudo-terminal, its stopwatch in it (`watched.py`), fed through the controller's own sockets with
what a controller sends in that many hours (`day.py`): 144,000 rows of trace, 1,440 holds in four runs, as many events.
They are played in `--minutes`, 40 snapshots a second; then `--still` minutes in real time, ten a second. Redraw: from a
look at the view to the last byte written because of it. Memory: resident set, every second; its slope over the second
half of what was played (the caches of the first half are full), per hour of the day, with a standard error from twelve
block means.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from benchmarks.console.day import Day
from rig.link.clients import Clients
from rig.link.sockets import listen
from tests.rig.console.terminal import Terminal, on_terminal

WATCHED = Path(__file__).with_name("watched.py")
FAST, REAL = 40.0, 10.0
"""Snapshots per s."""
BLOCKS = 12
Figures = dict[str, dict[str, float]]
Part = tuple[Figures, list[tuple[float, float]]]
PROMISE = 100.0
"""ms, p95 of a redraw."""


def resident(pid: int) -> float:
    """MB."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@contextmanager
def watched_console(
    socket: Path, figures: Path, size: tuple[int, int]
) -> Iterator[tuple[subprocess.Popen[bytes], Terminal]]:
    """The console; its figures are there once this is left."""
    code = f"import runpy, sys; sys.argv[0] = {str(WATCHED)!r}; runpy.run_path({str(WATCHED)!r}, run_name='__main__')"
    with on_terminal(code, str(socket), str(figures), size=size) as (process, terminal):
        try:
            yield process, terminal
        finally:
            process.terminate()
            process.wait(20.0)


def play(day: Day, clients: Clients, seconds: float, per_s: float, step: float, pid: int) -> list[tuple[float, float]]:
    """(s of the day, MB), once a second."""
    kept, begun, told = list[tuple[float, float]](), time.monotonic(), 0
    while (now := time.monotonic()) - begun < seconds:
        if day.forward(step):
            clients.clear_trace()
        for row in day.rows:
            clients.add_trace(row)
        clients.poll(now)
        clients.publish(day.snapshot())
        if int(now - begun) > told:
            told = int(now - begun)
            kept.append((day.time, resident(pid)))
        select.select([], [], [], max(1.0 / per_s - (time.monotonic() - now), 0.0))
    return kept


def slope(kept: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """MB per hour and its standard error, from the second half in block means: what is kept comes in steps."""
    half = np.array(kept[len(kept) // 2 :])
    blocks = [block.mean(axis=0) for block in np.array_split(half, BLOCKS)]
    t, m = np.array(blocks).T
    t = t / 3600.0
    (found, _), covariance = np.polyfit(t, m, 1, cov=True)
    return float(found), float(np.sqrt(covariance[0, 0]))


def quantiles(values: Sequence[float]) -> dict[str, float]:
    p50, p95, p99, most = (round(float(q), 1) for q in np.quantile(values, [0.5, 0.95, 0.99, 1.0]))
    return {"count": len(values), "median": p50, "p95": p95, "p99": p99, "worst": most}


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=float, default=4.0, help="of the campaign (default: 4)")
    parser.add_argument("--minutes", type=float, default=6.0, help="in which they are played (default: 6)")
    parser.add_argument("--still", type=float, default=1.0, help="minutes in real time after that (default: 1)")
    parser.add_argument("--size", default="160x48", help="columns x rows of the terminal (default: 160x48)")
    parser.add_argument("--page", default="1", help="key of the page that is shown (default: 1)")
    parser.add_argument("--json", type=Path, help="write the figures there as well")
    return parser.parse_args()


def part(
    folder: Path, name: str, day: Day, asked: argparse.Namespace, minutes: float, per_s: float, step: float
) -> Part:
    """One console; what it took and what it kept."""
    columns, rows = map(int, asked.size.split("x"))
    socket, figures = folder / f"{name}.sock", folder / f"{name}.json"
    clients = Clients(listen(socket))
    try:
        with watched_console(socket, figures, (columns, rows)) as (process, terminal):
            while not clients.connected:
                clients.poll(time.monotonic())
                select.select([], [], [], 0.05)
            clients.publish(day.snapshot())
            terminal.until(b"STOP")
            terminal.press(asked.page.encode())
            kept = play(day, clients, 60.0 * minutes, per_s, step, process.pid)
    finally:
        clients.close()
    return {key: quantiles(values) for key, values in json.loads(figures.read_text()).items()}, kept


def main() -> int:
    """1 when a redraw takes too long."""
    asked = arguments()
    print(f"terminal of {asked.size}, page {asked.page}, load {os.getloadavg()[0]:.1f} before\n", flush=True)
    print("| part | what | count | median ms | p95 ms | p99 ms | worst ms |\n|---|---|---|---|---|---|---|")
    with TemporaryDirectory() as scratch:
        day = Day()
        day.forward(1.0)
        step = 3600.0 * asked.hours / (60.0 * asked.minutes * FAST)
        told, kept = part(Path(scratch), "fast", day, asked, asked.minutes, FAST, step)
        _print(f"{day.time / 3600:.2f} h in {asked.minutes:g} min", told)
        real, _ = part(Path(scratch), "real", day, asked, asked.still, REAL, 1.0 / REAL)
        _print("real time after that", real)
    rise, error = slope(kept)
    first, half, last = kept[0][1], kept[len(kept) // 2][1], kept[-1][1]
    print(f"\nresident set: {first:.1f} MB at first, {half:.1f} MB half-way, {last:.1f} MB last")
    print(f"slope of the second half: {rise:+.2f} ± {error:.2f} MB/h (k = 1); load {os.getloadavg()[0]:.1f}")
    if asked.json:
        figures = {"played": told, "real": real, "memory": kept, "slope": [rise, error]}
        asked.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    return int(real["redraws"]["p95"] > PROMISE)


def _print(name: str, told: Figures) -> None:
    for what, q in told.items():
        row = (q["count"], q["median"], q["p95"], q["p99"], q["worst"])
        print(f"| {name} | {what} | {' | '.join(str(each) for each in row)} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
