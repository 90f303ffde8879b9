"""Two sets of answers of the blind proof, case by case: which verdicts, names and figures differ.

    python benchmarks/diagnosis/same_answers.py BEFORE.jsonl.gz AFTER.jsonl.gz [--figures]

Both are files that `rig prove --scores` wrote, of the same draw. A change of the code that means to change no answer is
held to this: of the cases that both hold it prints each in which verdict, findings, stated rivals or the place of what
is unexplained differ, then how many there were. `--figures`: where a held-out error or the middle of an interval moved
by more than a thousandth, too. Exit status 1 where any verdict or finding differs.
"""

from __future__ import annotations

import gzip
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

SAID = ("said", "named", "rivals", "place", "failed")
"""What is the answer of a case."""
MOVED = 1e-3
"""Relative change of a figure that is told."""


def scores(path: Path) -> dict[str, dict[str, Any]]:
    """Case -> its score."""
    with gzip.open(path, "rt") as lines:
        found = [json.loads(line) for line in lines]
    return {each["order"]["id"] + "".join(f" without {w}" for w in each["order"]["without"]): each for each in found}


def differences(one: dict[str, Any], other: dict[str, Any]) -> Iterator[str]:
    """What was answered otherwise."""
    for key in SAID:
        if one[key] != other[key]:
            yield f"{key} {one[key]!r} -> {other[key]!r}"


def figures(one: dict[str, Any]) -> list[float]:
    held = one["held_out"]
    return [
        *(held.values() if held else ()),
        *(v for i in one["intervals"] for v in i.values() if isinstance(v, float)),
    ]


def moved(one: dict[str, Any], other: dict[str, Any]) -> float:
    """Largest relative change of a figure; 1 where there are not as many."""
    a, b = figures(one), figures(other)
    if len(a) != len(b):
        return 1.0
    return max((abs(x - y) / max(abs(x), abs(y), 1e-12) for x, y in zip(a, b, strict=True)), default=0.0)


def main(before: str, after: str, *options: str) -> int:
    old, new = scores(Path(before)), scores(Path(after))
    both = sorted(old.keys() & new.keys())
    other, shifted = 0, 0
    for case in both:
        found = list(differences(old[case], new[case]))
        by = moved(old[case], new[case])
        shifted += by > MOVED
        if found or ("--figures" in options and by > MOVED):
            print(f"{case}: {'; '.join(found)} (figures move by {by:.1e})")
        other += bool(found)
    print(f"{len(both)} cases in both: {other} answered otherwise; {shifted} with a figure moved by {MOVED:g} or more")
    return 1 if other else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
