"""kill -9 of the recorder at random instants, while others keep the machine busy: is every flushed row there?

    python benchmarks/controller/kill_recorder.py [KILLS] [--jobs 4] [--busy 1] [--seed 1]

Every fourth is killed while it closes. Each file is read by `load`, and by `recover` where it was growing; one that is
not as promised is kept in build/kill-recorder, and told with its seed.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.rig.recording.killed_recorder import kill_once

KEPT = Path("build/kill-recorder")


def one(order: tuple[int, int]) -> tuple[int, str]:
    """Rows that were flushed, and what was wrong; empty: nothing."""
    seed, number = order
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{seed}-{number}.h5"
        try:
            return sum(kill_once(path, np.random.default_rng([seed, number]), closing=number % 4 == 3)), ""
        except Exception:  # noqa: BLE001 - whatever it is, the file is kept and it is told
            KEPT.mkdir(parents=True, exist_ok=True)
            if path.exists():
                (KEPT / path.name).write_bytes(path.read_bytes())
            return 0, f"{path.name}: {traceback.format_exc(limit=2)}"


def _count() -> None:
    while True:
        pass


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """Processes that only count."""
    started = [multiprocessing.Process(target=_count, daemon=True) for _ in range(processes)]
    for process in started:
        process.start()
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.join()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kills", type=int, nargs="?", default=5000)
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("--busy", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    begun, flushed, wrong = time.monotonic(), 0, list[str]()
    with busy(given.busy), multiprocessing.Pool(given.jobs, _ignore_interrupts) as pool:
        orders = ((given.seed, number) for number in range(given.kills))
        for done, (rows, trouble) in enumerate(pool.imap_unordered(one, orders), 1):
            flushed += rows
            wrong += [trouble] if trouble else []
            if done % 250 == 0 or trouble:
                print(f"{done} kills, {len(wrong)} not as promised {trouble}", flush=True)
    took, load = time.monotonic() - begun, os.getloadavg()[2]
    print(
        f"{given.kills - len(wrong)} of {given.kills} files opened and held every flushed row ({flushed:,} rows), in"
        f" {took:.0f} s, load {load:.1f}"
    )
    return 1 if wrong else 0


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


if __name__ == "__main__":
    sys.exit(main())
