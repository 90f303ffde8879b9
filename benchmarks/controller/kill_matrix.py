"""The kill matrix: each process of a campaign x each signal x each phase. Does the motor rest, are the files readable,
does anybody hang?

    python benchmarks/controller/kill_matrix.py [--only 'PROCESS/SIGNAL/PHASE']... [--store FILE] [--seed N] [--again]

Processes: controller, recorder, watcher, console, headless, device. Signals: TERM, HUP, INT2 (two interrupts within
50 ms), KILL, STOP, STOPCONT. Phases: proof, tare, ramp, hold, flush, pause, mount, between (two steps), closing.
`--only` may hold * and be repeated. What is in the store is not tried again, unless it was bad and `--again` is said. A
cell takes some 15 s on an idle machine: all 324 take an hour and a half. Status 1 when a cell is bad.

In the table `ok` is a campaign that went on to its end, a number the seconds that the motor was still driven.
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
import time
from fnmatch import fnmatch
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.reliability.kills.kill_cells import PHASES, PROCESSES, SIGNALS, Cell, NotBegun
from tests.reliability.kills.kill_matrix import cell_of, line, told, try_cell
from tests.reliability.machine.metronome import metronome

TRIES = 3
"""Of a cell whose phase did not come: on a busy machine a run may end before it."""


def main(only: list[str], store: Path, seed: int, *, again: bool) -> int:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # behind nohup(1), or in the background of a shell, they are ignored,
    signal.signal(signal.SIGINT, signal.default_int_handler)  # and so they would be by everybody who is started here
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # whoever ends this ends what it started
    cells = [(p, s, f) for f in PHASES for s in SIGNALS for p in PROCESSES]
    wanted = [cell for cell in cells if any(fnmatch("/".join(cell), pattern) for pattern in only or ["*"])]
    known = {}
    for text in store.read_text(encoding="utf-8").splitlines() if store.exists() else []:
        cell = cell_of(text)
        known[cell.process, cell.signal, cell.phase] = cell
    store.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, store.open("a", encoding="utf-8") as out:
        late = Path(folder) / "late"
        with metronome(late):
            for which in wanted:
                if which in known and not (again and known[which].faults):
                    continue
                if (tried := _tried(which, seed, late)) is not None:
                    known[which] = tried
                    out.write(line(tried) + "\n")
                    out.flush()
    print(told([known[which] for which in wanted if which in known]))
    return int(any(known[which].faults for which in wanted if which in known))


def _tried(which: tuple[str, str, str], seed: int, late: Path) -> Cell | None:
    begun = time.monotonic()
    for number in range(TRIES):
        with tempfile.TemporaryDirectory() as folder:
            try:
                cell = try_cell(Path(folder), *which, seed + number, late)
            except NotBegun as error:
                print(f"{'/'.join(which)}: {error}", flush=True)
                continue
        print(f"{'/'.join(which)}: {cell.outcome}, driven {cell.driven:.2f} s, files {cell.files}; "
              f"{'; '.join(cell.faults) or 'good'} ({time.monotonic() - begun:.0f} s)", flush=True)  # fmt: skip
        return cell
    return None


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--store", type=Path, default=Path("build/kill-matrix.jsonl"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--again", action="store_true")
    asked = parser.parse_args()
    sys.exit(main(asked.only, asked.store, asked.seed, again=asked.again))
