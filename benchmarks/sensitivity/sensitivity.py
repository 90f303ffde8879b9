"""What half and double of the thresholds that matter most would change in the answers: works them out.

    python benchmarks/sensitivity/sensitivity.py [--jobs 2] [--out FILE] [--cases N] [--only NAME ...]
    python benchmarks/sensitivity/sensitivity.py --check --cases N      # each setting from its beginning, too
    python benchmarks/sensitivity/sensitivity_table.py --page           # what is in the file, into docs/sensitivity.md

Each of the thresholds of sensitivity_settings.py is put at half and at double, one at a time, and every case of a fixed
set (sensitivity_set.py) is answered as in the blind proof: `python -m sim_devices conceal` makes recordings and seals
the truth, `rig.blind.answering.answered` diagnoses, `rig.blind.scoring` puts both side by side. All settings of a case
are answered by one diagnosis that branches where a threshold first turns a decision (branching.py): some six times the
work of one, and not forty. `--check` answers at each setting by a diagnosis of its own, and ends where anything that is
told differs; nothing is stored.

The same command goes on where it ended, with the same version of the diagnosis (sensitivity_store.py). `--also VERSION`
takes what another version answered as well: for whoever knows that it answers the same.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import argparse
import gc
import json
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from hashlib import sha256
from pathlib import Path
from shutil import rmtree
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from branching import answers
from sensitivity_set import DRAW, cases
from sensitivity_settings import ASKED, AT_VALUE, Setting, settings
from sensitivity_store import Row, costs, known, line, version

from identification.mismatch import policy
from rig.blind.answering import answered
from rig.blind.command import designed
from rig.blind.scoring.score import OPEN_CELLS, scored
from rig.blind.store import Store

ROOT = Path(__file__).resolve().parents[2]
LIMIT = 120.0
"""s of CPU for one diagnosis; a longer one has failed."""
OUT = Path("build/sensitivity.jsonl")
NICE = 10


def overdue(*_: object) -> None:
    raise TimeoutError(f"took more than {LIMIT:g} s of CPU")


def _diagnosed(folder: Path, without: Sequence[str]) -> Row:
    """The answer, without how long it took."""
    signal.setitimer(signal.ITIMER_PROF, LIMIT)
    try:
        answer, _ = answered(folder, tuple(without))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return {key: value for key, value in answer.items() if key != "seconds"}


def _at(setting: Setting, work: Callable[[], Row]) -> Row:
    """By a diagnosis of its own."""
    with policy.overridden({setting.threshold: setting.value}):
        return work()


def _broken(answer: Row) -> bool:
    """What the diagnosis says by itself has an error too, or has none: it is asked."""
    return bool(answer["error"]) and not answer["error"].startswith("TimeoutError")


def told(work: Callable[[], Row], asked: Sequence[Setting]) -> tuple[dict[str, Row], dict[str, float]]:
    """The answers at the values themselves and at each setting, and the s of CPU of each."""
    moved: dict[str, dict[str, float]] = defaultdict(dict)
    for setting in asked:
        moved[setting.threshold][setting.id] = setting.value
    begun = time.process_time()
    base, found = answers(moved, work)
    cost = {AT_VALUE: time.process_time() - begun, **{each: seconds for each, (_, seconds) in found.items()}}
    out = {AT_VALUE: work() if _broken(base) else base}
    for setting in asked:
        answer, _ = found[setting.id]
        out[setting.id] = _at(setting, work) if _broken(answer) else answer
    return out, cost


def _row(score: Any) -> Row:
    row = {"said": score.said, "named": score.named, "right": score.right, "alone": score.alone, "wrong": score.wrong}
    outcome = score.outcome if score.order.cell in OPEN_CELLS else ""
    return {**row, "counted": score.counted, "outcome": outcome, "failed": score.failed}


def judged(case: str, only: Sequence[str], root: Path, *, check: bool) -> tuple[dict[str, Row], dict[str, float]]:
    """All settings of one case, in this process and its branches; its recordings are made and deleted.

    Nothing where no such case could be drawn. Raises ValueError where with `check` a diagnosis says anything else.
    """
    gc.collect()  # what the last diagnosis leaves is hundreds of megabytes, and every branch would share them
    (job,) = designed(20, [case], DRAW)
    (order,) = job.orders
    store = Store(root / sha256(case.encode()).hexdigest()[:12])
    world = [sys.executable, "-m", "sim_devices", "conceal", "-", str(store.root)]
    store.opened.mkdir(parents=True, exist_ok=True)
    subprocess.run(world, input=json.dumps(job.asked()) + "\n", text=True, check=True, capture_output=True, cwd=ROOT)
    signal.signal(signal.SIGPROF, overdue)
    truth = store.truth(job)
    rows: dict[str, Row] = {}
    cost: dict[str, float] = {}
    if truth is not None and not truth["error"]:

        def work() -> Row:
            return _diagnosed(store.opened / job.token, order.without)

        found, cost = told(work, settings(only))
        if check:
            _check(case, found, work, only)
        rows = {each: _row(scored(order, truth, {**answer, "seconds": 0.0})) for each, answer in found.items()}
    rmtree(store.root, ignore_errors=True)
    return rows, cost


def _check(case: str, found: dict[str, Row], work: Callable[[], Row], only: Sequence[str]) -> None:
    alone = {AT_VALUE: work(), **{setting.id: _at(setting, work) for setting in settings(only)}}
    for setting, answer in alone.items():
        if answer != found[setting]:
            raise ValueError(f"{case}, {setting}: by itself it says {answer}, but {found[setting]} where it branched")


def _yielding() -> None:
    """To whatever else this machine does."""
    os.nice(max(NICE - os.nice(0), 0))


def run(asked: argparse.Namespace, versions: Sequence[str]) -> None:
    """What is not in the file yet; with `check` whatever there is, and nothing is put there."""
    wanted = {AT_VALUE, *(setting.id for setting in settings(asked.only))}
    done = {} if asked.check else known(asked.out, versions)
    there = {case for case, rows in done.items() if not rows or wanted <= rows.keys()}  # some could not be drawn
    pending = [case for case in cases()[: asked.cases] if case not in there]
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    root, begun = asked.out.with_suffix(".check" if asked.check else ""), time.monotonic()
    with ProcessPoolExecutor(asked.jobs, initializer=_yielding) as pool:
        jobs = {pool.submit(judged, case, asked.only, root, check=asked.check): case for case in pending}
        for number, job in enumerate(as_completed(jobs), 1):
            try:
                rows, cost = job.result()
            except EOFError:
                print(f"{jobs[job]}: a branch was killed; the next run asks it again", file=sys.stderr)
                continue
            if not asked.check:
                with asked.out.open("a", encoding="utf-8") as file:
                    file.write(line(jobs[job], versions[0], rows, AT_VALUE, cost))
            each = (time.monotonic() - begun) / number
            left = (len(jobs) - number) * each / 60
            print(f"{number} of {len(jobs)}: {jobs[job]}, {sum(cost.values()):.0f} s; {left:.0f} min", file=sys.stderr)
    seconds = costs(asked.out, versions)
    print(f"{len(seconds)} cases in {asked.out}, {sum(seconds) / 3600:.2f} h of one core, version {versions[0]}")


def main(arguments: Sequence[str]) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--out", type=Path, default=OUT, help="JSON lines, gone on with")
    parser.add_argument("--cases", type=int, help="only so many, the first ones")
    parser.add_argument("--only", nargs="+", default=[], choices=list(ASKED), help="only these thresholds")
    parser.add_argument("--also", nargs="+", default=[], help="versions of the diagnosis whose answers count too")
    parser.add_argument("--check", action="store_true", help="answer at each setting by itself, too, and compare")
    asked = parser.parse_args(arguments)
    run(asked, [version(), *asked.also])


if __name__ == "__main__":
    main(sys.argv[1:])
