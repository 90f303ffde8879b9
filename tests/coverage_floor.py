"""Branch coverage that must hold, part by part, and that of each room; run after pytest --cov.

Exit status 1 when a part falls below its floor. The rooms are told, so that one sees where a part's holes are.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import coverage

FLOOR = 95.0
"""Per cent of statements and branches together."""
PARTS = ("drivers/*", "identification/*", "rig/safety/guard.py", "rig/sequence/sequencer.py")
ROOMS = ("identification/mismatch", "rig")
"""Packages whose rooms are told."""


def rooms_of(package: str) -> list[tuple[str, list[str]]]:
    """(name, patterns) of each folder with modules in it, and of the files that are in no room."""
    folders = sorted(each for each in Path(package).iterdir() if each.is_dir() and any(each.glob("*.py")))
    return [(f"{package}/*.py", [f"{package}/*.py"]), *((str(each), [f"{each}/*"]) for each in folders)]


def covered(data: coverage.Coverage, patterns: list[str], besides: list[str] | None = None) -> float | None:
    """Per cent, None where nothing of it was measured."""
    try:
        return data.report(include=patterns, omit=besides, file=io.StringIO())
    except coverage.exceptions.NoDataError:
        return None


def told(percent: float | None) -> str:
    return "   none" if percent is None else f"{percent:6.1f} %"


def main() -> int:
    data = coverage.Coverage()
    data.load()
    for package in ROOMS:
        own, *rooms = rooms_of(package)
        inside = [pattern for _, patterns in rooms for pattern in patterns]
        rows = [(own[0], covered(data, own[1], inside)), *((name, covered(data, each)) for name, each in rooms)]
        sys.stdout.write(f"\nbranch coverage of the rooms of {package}\n")
        for name, percent in rows:
            sys.stdout.write(f"  {name:<44} {told(percent)}\n")
    sys.stdout.write("\n")
    low = 0
    for part in PARTS:
        percent = covered(data, [part]) or 0.0
        sys.stdout.write(f"branch coverage of {part:<28} {percent:6.1f} % (floor {FLOOR:g} %)\n")
        low += percent < FLOOR
    return 1 if low else 0


if __name__ == "__main__":
    sys.exit(main())
