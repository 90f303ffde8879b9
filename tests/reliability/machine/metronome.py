"""Does this machine keep time? A process that only wakes and notes when it was woken late: it has no part in what is
tested, so what holds it up (a stolen virtual core, a disk that stalls all) is not the product's.

    python -m tests.reliability.machine.metronome FILE
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

PROJECT: Final = Path(__file__).parents[3]
BEAT: Final = 0.005
"""s between wakes."""
LATE: Final = 0.01
"""s past its time that are noted; less is how an idle machine wakes a process."""


@contextmanager
def metronome(file: Path) -> Iterator[None]:
    """Run one beside the tests; `stalled` reads its `file`."""
    file.touch()
    process = subprocess.Popen([sys.executable, "-m", "tests.reliability.machine.metronome", str(file)], cwd=PROJECT)
    try:
        yield
    finally:
        process.terminate()
        process.wait(10)


def stalled(file: Path, since_ns: int, until_ns: int) -> float:
    """s between two instants of the monotonic clock during which the metronome was not woken though it was due."""
    return sum(_within(file, since_ns, until_ns)) * 1e-9


def longest(file: Path, since_ns: int, until_ns: int) -> float:
    """s of the longest such time on end."""
    return max(_within(file, since_ns, until_ns), default=0) * 1e-9


def _within(file: Path, since_ns: int, until_ns: int) -> list[int]:
    """ns of each late wake that lie between the two."""
    pairs = [tuple(map(int, line.split())) for line in file.read_text().split("\n")[:-1]]
    return [max(0, min(woken, until_ns) - max(due, since_ns)) for due, woken in pairs]


def main(file: Path) -> None:
    """Append `due woken`, both ns of the monotonic clock, for each late wake, until this process is ended."""
    with file.open("a") as out:
        due = time.monotonic_ns()
        while True:
            due += round(BEAT * 1e9)
            time.sleep(max(0.0, (due - time.monotonic_ns()) * 1e-9))
            woken = time.monotonic_ns()
            if woken - due > LATE * 1e9:
                out.write(f"{due} {woken}\n")
                out.flush()
                due = woken


if __name__ == "__main__":
    main(Path(sys.argv[1]))
