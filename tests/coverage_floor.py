"""Branch coverage that must hold, part by part; run after pytest --cov. Exit status 1 when one falls below."""

from __future__ import annotations

import io
import sys

import coverage

FLOOR = 95.0
"""Per cent of statements and branches together."""
PARTS = ("drivers/*", "identification/*", "rig/safety/guard.py", "rig/sequence/sequencer.py")


def main() -> int:
    data = coverage.Coverage()
    data.load()
    low = 0
    for part in PARTS:
        percent = data.report(include=[part], file=io.StringIO())
        sys.stdout.write(f"branch coverage of {part:<20} {percent:6.1f} % (floor {FLOOR:g} %)\n")
        low += percent < FLOOR
    return 1 if low else 0


if __name__ == "__main__":
    sys.exit(main())
