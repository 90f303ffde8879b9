"""Ambiguous designs settled on the simulated bench, in virtual time: staircase up only, flow that follows, no rest.

    python benchmarks/experiments/settle.py [RUNS] [--run K] [--budget MIN] [--design NAME] [--effect ID] [--verbose]

Each run draws a thruster, its scales, noise and channels, conceals one effect at 12 to 40 sigma, and records the
design; drawn anew until an oracle, too, could take another effect for it (less than 2 sigma would be left). Then it
settles: the core of `rig settle`, the sweeps run on the simulated bench. What was concealed is looked at in the end.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from identification.mismatch.next_experiment.sequential_experiment import Course, End, round_line
from rig.diagnose.text import diagnosis_text
from tests.concealed.ambiguous import Bench, drawn


def judged(course: Course, truth: str) -> str:
    """Of the final answer."""
    now, among = course.now, set().union(*course.now.doubt) if course.now.doubt else set()
    if now.verdict == "explained" and now.effects == {truth}:
        return "right"
    if now.verdict == "explained" and truth in now.effects:
        return "right with more"
    if now.verdict == "ambiguous" and truth in now.effects | among:
        return "among rivals"
    if now.verdict == "unexplained":
        return "unexplained, named" if truth in now.effects | among else "unexplained"
    return "wrong"


def began(course: Course, truth: str) -> str:
    """Of the first answer."""
    among = set().union(*course.first.doubt) if course.first.doubt else set()
    right = "with truth" if truth in course.first.effects | among else "without truth"
    return f"{course.first.verdict} {right}"


def shown(number: int, course: Course, end: End, bench: Bench) -> None:
    truth = bench.ambiguous.effect
    clock = f"{len(course.rounds)} rounds, {course.on_bench / 60:.1f} min on the bench"
    like, design = ", ".join(bench.ambiguous.twins), bench.ambiguous.design
    print(f"{number:3d} {design}, {truth} (like {like}): first {course.first.verdict}: {course.first.says}")
    print(f"    {clock}, ended {end.reason}; {course.now.verdict}: {course.now.says} -> {judged(course, truth)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="?", type=int, default=50)
    parser.add_argument("--run", type=int, help="only the run of this number")
    parser.add_argument("--budget", type=float, default=20.0, metavar="MIN")
    parser.add_argument("--design", default="")
    parser.add_argument("--effect", default="")
    parser.add_argument("--verbose", action="store_true", help="every diagnosis in full")
    asked = parser.parse_args()
    numbers = [asked.run] if asked.run is not None else range(asked.runs)
    first, last, on_bench, rounds = Counter(), Counter(), 0.0, 0
    begin = process_time()
    for number in numbers:
        bench = Bench(drawn(number, asked.design, asked.effect), 60.0 * asked.budget)
        course, end = bench.settle()
        truth = bench.ambiguous.effect
        shown(number, course, end, bench)
        if asked.verbose:
            said(course, bench)
        first[began(course, truth)] += 1
        if course.rounds:
            last[judged(course, truth)] += 1
            rounds += len(course.rounds)
            on_bench += course.on_bench
        sys.stdout.flush()
    print(f"first: {', '.join(f'{n} {what}' for what, n in first.most_common())}")
    print(f"after experiments: {', '.join(f'{n} {what}' for what, n in last.most_common())}")
    took = max(last.total(), 1)
    print(
        f"{rounds} rounds, {on_bench / took / 60:.1f} min on the bench each; "
        f"{process_time() - begin:.0f} s of computing for all"
    )


def said(course: Course, bench: Bench) -> None:
    for k, found in enumerate(bench.diagnoses):
        if k:
            print(round_line(Course(course.budget, course.first, 0.0, course.rounds[:k])))
        print(diagnosis_text(found))


if __name__ == "__main__":
    main()
