"""Fuzzing of everything that takes input from outside.

    python benchmarks/fuzz.py decoders N      N mutated frames and lines into each decoder
    python benchmarks/fuzz.py recordings N    N mutated recordings: closed, killed, growing
    python benchmarks/fuzz.py toml N          N mutated campaigns, benches and maps
    python benchmarks/fuzz.py sockets N       N requests, floods, notes of 10 MB
    options: --seed S     --folder F: what hurt is kept there (build/fuzz)

Recordings and TOML go through the command line (`rig fit`, `rig recover`, `rig check`, `rig import`) with 10 s of a
processor and 1 GiB each, in forks of one process in which everything is imported. What hurts: an uncaught exception, a
signal, an exit status that is none of the command line's, a control character sent to the terminal, an infinite number.
Prints a line for each kind and the inputs that hurt; status 1 if there were any.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("decoders", "recordings", "toml", "sockets"))
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=Path("build/fuzz"))
    given = parser.parse_args()
    from fuzzing import decoders, files, sockets

    run = {
        "decoders": decoders.run,
        "recordings": files.run_recordings,
        "toml": files.run_tomls,
        "sockets": sockets.run,
    }
    tallies = run[given.what](given.count, given.seed, given.folder.resolve())
    for tally in tallies:
        print(tally.summary())
    return int(any(tally.hurt for tally in tallies))


if __name__ == "__main__":
    sys.exit(main())
