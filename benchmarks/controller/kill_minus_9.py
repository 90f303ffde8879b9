"""kill -9 of the controller at random instants of a sweep: does the motor stop, does the file open, what is lost?

    python benchmarks/controller/kill_minus_9.py [KILLS]

Times are those of the simulated bench's truth log, in another process.
"""

from __future__ import annotations

import random
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.reliability.live import SLACK, TICK, WATCHDOG, Killed, kill_once, live_bench


def main(kills: int) -> int:
    """Print a table; 0 when every one stopped and left a readable file."""
    chance, all_killed = random.Random(20), list[Killed]()
    print(f"allowed until release: {WATCHDOG + TICK:.2f} s (device watchdog + one tick)")
    print("kill  state     release s  at rest  outcome   complete  lost s")
    with tempfile.TemporaryDirectory() as folder, live_bench(Path(folder)) as bench:
        for number in range(kills):
            k = kill_once(bench, chance.uniform(0.0, 10.0))
            all_killed.append(k)
            print(
                f"{number + 1:4d}  {k.state:<9} {k.release:9.3f}  {k.rested!s:<7}  {k.outcome:<8}  {k.complete!s:<8}  "
                f"{k.lost:.3f}",
                flush=True,
            )
    good = [k for k in all_killed if k.rested and k.complete and k.release <= WATCHDOG + TICK + SLACK]
    worst, lost = max(k.release for k in all_killed), max(k.lost for k in all_killed)
    print(f"{len(good)} of {kills} good; slowest release {worst:.3f} s; most lost {lost:.3f} s")
    return 0 if len(good) == kills else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 20))
