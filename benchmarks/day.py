"""A day at the console, by somebody who has only keys: on a terminal of tmux, on a second one, and in a browser.

    python benchmarks/day.py [--only tmux|second|browser] [--transcript FILE] [--keep FOLDER]

A simulated bench of `rig init`, real commands and consoles; each step says what the screen has to show, and the bench's
truth log what the motor did. All that stood on the screen, with the key that led to it, goes into the transcript
(build/day.txt).
Prints each chapter with its time. Status 0 only when all was as it has to be; 1 else, with what was not.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.operating.at_keys import DayError, Operator, Transcript
from benchmarks.operating.browser import in_browser
from benchmarks.operating.one_day import Day
from benchmarks.operating.preparing import at_work
from benchmarks.operating.second_terminal import second_terminal
from benchmarks.operating.tmux import there_is_tmux
from tests.rig.serve.chromium import CHROMIUM

THRUSTERS = ("T1", "T2", "T3")


def one_terminal(folder: Path, transcript: Transcript) -> None:
    """From `rig init` to the comparison of fits."""
    with at_work(folder, transcript, 2.0) as (_, operator, place):
        day = Day(operator, place, THRUSTERS)
        for chapter in (
            day.check_a_port_that_is_gone,
            day.edit,
            day.calibrate,
            day.preflight,
            day.first_thruster,
            day.trip,
            day.resume,
            day.diagnose,
            day.report,
            day.catalogue,
        ):
            chapter()


def two_terminals(folder: Path, transcript: Transcript) -> None:
    with at_work(folder, transcript, 8.0) as (tmux, operator, place):
        gallery = Operator(tmux.window("gallery", place.folder), transcript)
        second_terminal(operator, gallery, place)


def a_browser(folder: Path, transcript: Transcript) -> None:
    if CHROMIUM is None:
        raise DayError("no Chromium on this machine (Debian: apt install chromium)")
    with at_work(folder, transcript, 8.0) as (tmux, operator, place):
        server = Operator(tmux.window("server", place.folder), transcript)
        asyncio.run(in_browser(operator, server, place, folder))


PARTS: dict[str, Callable[[Path, Transcript], None]] = {
    "tmux": one_terminal,
    "second": two_terminals,
    "browser": a_browser,
}


def main() -> int:
    """0, or 1 when something was not as it has to be."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=PARTS, help="this part alone")
    parser.add_argument("--transcript", type=Path, default=Path("build/day.txt"))
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="benches, recordings and pictures stay there")
    asked = parser.parse_args()
    if not there_is_tmux():
        print("day.py needs tmux (Debian: apt install tmux)", file=sys.stderr)
        return 1
    asked.transcript.parent.mkdir(parents=True, exist_ok=True)
    asked.transcript.write_text("", encoding="utf-8")
    transcript = Transcript(asked.transcript)
    failed = 0
    with tempfile.TemporaryDirectory(prefix="day-") as scratch:
        for name in [asked.only] if asked.only else list(PARTS):
            failed += not _held(name, (asked.keep or Path(scratch)).resolve() / name, transcript)
    print(f"{transcript.found} things were looked for and found; transcript: {asked.transcript}")
    return 1 if failed else 0


def _held(name: str, folder: Path, transcript: Transcript) -> bool:
    folder.mkdir(parents=True)
    begun = time.monotonic()
    try:
        PARTS[name](folder, transcript)
    except (DayError, AssertionError, TimeoutError) as error:  # the last two are Chromium's
        transcript.write(f"\nFAILED: {error}")
        print(f"{name}: FAILED: {error}")
        return False
    print(f"{name}: held, {time.monotonic() - begun:.0f} s, load {os.getloadavg()[0]:.1f}", flush=True)
    return True


if __name__ == "__main__":
    sys.exit(main())
