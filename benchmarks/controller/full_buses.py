"""Two full CAN buses and three load cells of 1 kHz: is anything lost, how late is the loop, what does it take?

    python benchmarks/controller/full_buses.py [--seconds 600] [--rate 7000] [--busy 8] [--json FILE]

A campaign on a simulated bench with its own recorder, through ptys: the motor's bus has RATE frames/s of others beside
its own (1 Mbit/s holds some 7,000 of 29 bits and 8 bytes), a second bus as many and a VESC whose STATUS_5, a thousand
a second, counts itself; three amplifiers send a line a millisecond. Once so, and once beside `--busy` processes that
only count. Lost are: counts that are missing in the recording, bad frames and lines, what an inbox dropped, and what
the host's buffer did not take. A trip is told with its cause.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from loop_lateness import FIGURES, processor_time

from identification.recording import Recording
from rig.hdf5 import load
from rig.link.front_end_messages import Snapshot
from tests.reliability.live import LiveBench, attach, live_bench

HERE = Path(__file__).parent
COUNTING = 42
CELLS = ("cell_a", "cell_b", "cell_c")
LINE = """
[devices.{name}]
kind = "line_stream"
port = "ports/{name}"
baud = 921600
pattern = '(?P<raw>-?\\d+)'
rate = 1000.0
line_characters = 11
scale = 0.001
"""
SENDER = """
[devices.{name}]
kind = "line"
port = "{name}"
baud = 921600
rate = 1000.0
newtons_per_count = 0.001
"""


def bench_file(text: str) -> str:
    head, _, rest = text.partition("[can.bus0]")
    limits = rest[rest.index("[limits") :].replace("load_cell", "cell_a")
    motor = rest[rest.index("[devices.motor]") : rest.index("[devices.flow]")]
    buses = "".join(
        f'[can.bus{k}]\ninterface = "slcan"\nchannel = "ports/full{k}"\nbitrate = 1000000\n' for k in (0, 1)
    )
    counting = motor.replace("[devices.motor]", "[devices.counting]").replace("bus0", "bus1")
    counting = counting.replace(
        "vesc_id = 23", f"vesc_id = {COUNTING}\nrate = 50.0\nsupply_rate = 1000.0\nthermal_rate = 0.0"
    )
    cells = "".join(LINE.format(name=name) for name in CELLS)
    return head.replace('"load_cell"', '"cell_a"') + buses + motor + counting + cells + limits


def world_file(text: str) -> str:
    start, end = text.index("[devices.load_cell]"), text.index("[devices.motor]")
    slow = text.index("[devices.flow]")
    return text[:start] + "".join(SENDER.format(name=name) for name in CELLS) + text[end:slow]


@contextmanager
def traffic(folder: Path, rate: float, bus: int) -> Iterator[tuple[dict[str, int], Callable[[int], None]]]:
    """What fills when it ends: frames sent, and lost by the host's buffer, between two signals; and what sends them."""
    more = ["--behind", str(folder / "ports" / "can0")] if bus == 0 else ["--counting", str(COUNTING)]
    words = [sys.executable, str(HERE / "can_traffic.py"), str(folder / "ports" / f"full{bus}"), str(rate), *more]
    told: dict[str, int] = {}
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield told, process.send_signal
        finally:
            process.terminate()
            told.update(json.loads(process.stdout.readline() or '{"frames": 0, "lost": -1}'))


def count_for_ever() -> None:
    while True:
        sum(range(10_000))


@contextmanager
def busy(many: int) -> Iterator[None]:
    """So many processes that never rest."""
    every = [multiprocessing.Process(target=count_for_ever, daemon=True) for _ in range(many)]
    for each in every:
        each.start()
    try:
        yield
    finally:
        for each in every:
            each.kill()
            each.join()


def children(pid: int) -> list[int]:
    """The recorder and the watcher."""
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def missing(recording: Recording) -> int:
    """STATUS_5 messages between the first and the last that are not in the recording, or twice."""
    (count,) = [c for c in recording.channels if c.stream == "counting_supply" and c.name == "tachometer"]
    return int(np.sum(np.abs(np.diff(count.value) - 1)))


def measured(bench: LiveBench, seconds: float, tell: Callable[[int], None]) -> dict[str, Any]:
    """One campaign of four levels on that bench; `tell`: what to signal when its holds begin and end."""
    run = bench.start(dwell=seconds / 4, **{"max_drift = 1.0": "max_drift = 5.0"})
    front = attach(run)
    front.begin(lambda s: s.state == "hold", timeout=120.0)
    recorders, began, took, told = children(run.pid), time.monotonic(), 1.0, False
    tell(signal.SIGUSR1)
    before = [processor_time(pid) for pid in (run.pid, *recorders)]
    spent, last = before, front.last

    def over(snapshot: Snapshot) -> bool:
        nonlocal spent, last, took, told
        if snapshot.state in ("stopping", "done") and not told:
            tell(signal.SIGUSR2)
            told = True
        if snapshot.state not in ("stopping", "done"):
            spent, last = [processor_time(pid) for pid in (run.pid, *recorders)], snapshot
            took = time.monotonic() - began
        return snapshot.state == "done"

    end = front.until(over, timeout=2 * seconds + 120.0)
    front.peer.close()
    bench.controllers[-1].wait(60)
    (path,) = Path(run.folder).glob("*.h5")
    recording = load(path)
    found = next((m for event in recording.events if (m := FIGURES.search(event.text))), None)
    assert last is not None
    return {
        "outcome": f"{end.outcome} {end.cause}".strip(),
        "seconds": round(took, 1),
        "lateness_ms": [float(word) for word in found.groups()[:3]] if found else None,  # worst, p99, p50
        "controller": (spent[0] - before[0]) / took,
        "others": sum(s - b for s, b in zip(spent[1:], before[1:], strict=True)) / took,
        "missing": missing(recording),
        "rows": {c.stream: c.time.size for c in recording.channels},
        "bad": sum(d.bad for d in last.devices),
        "dropped": sum(d.dropped for d in last.devices),
    }


def trial(seconds: float, rate: float, many: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        bench = stack.enter_context(live_bench(folder, world_file, bench_file))
        buses = [stack.enter_context(traffic(folder, rate, bus)) for bus in (0, 1)]
        stack.enter_context(busy(many))

        def tell(number: int) -> None:
            for _, send in buses:
                send(number)

        found = measured(bench, seconds, tell)
        stack.close()
    every = [told for told, _ in buses]
    return {"busy": many, **found, "frames": sum(b["frames"] for b in every), "lost": sum(b["lost"] for b in every)}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=60.0, help="of the four holds together")
    parser.add_argument("--rate", type=float, default=7000.0, help="frames/s of others on each bus")
    parser.add_argument("--busy", type=int, default=8)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    print(f"load average before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    found = [trial(asked.seconds, asked.rate, many) for many in ((0, asked.busy) if asked.busy else (0,))]
    for one in found:
        worst, p99, p50 = one["lateness_ms"] or [float("nan")] * 3
        print(
            f"{one['busy']} busy: {one['outcome']}, {one['seconds']:.0f} s, {one['frames']:,} frames; "
            f"lost: {one['lost']} by the buffer, {one['missing']} counts, {one['bad']} bad, {one['dropped']} dropped; "
            f"loop late p50 {p50:.2f}, p99 {p99:.2f}, worst {worst:.2f} ms; "
            f"controller {100 * one['controller']:.0f} %, recorder and watcher {100 * one['others']:.0f} % of a core"
        )
    if asked.json:
        asked.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
