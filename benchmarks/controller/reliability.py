"""The 35 promises of docs/reliability.md: every test that the page names for them, as often as they say.

    make reliability                                            all of it, an hour and a half on a calm machine
    python benchmarks/controller/reliability.py [NUMBER ...]    those only; the others keep what is known of them
    python benchmarks/controller/reliability.py --short ...     as often as `make test` does
    python benchmarks/controller/reliability.py --collect       runs nothing: sums up what `make test` has left

Writes build/reliability.json: of each promise how its tests ended, and count, median and worst of what they measured
(time to zero, losses, times of detection). `--publish` puts it into docs/reliability.json and its table into README.md.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from tests.reliability.page.measured import FILE
from tests.reliability.page.promises_page import PAGE, Promise, promises
from tests.reliability.page.summary import put, summed, told

PROJECT = Path(__file__).resolve().parents[2]
LINES = PROJECT / "build" / "reliability.jsonl"
RESULT = PROJECT / "build" / "reliability.json"
PUBLISHED = PROJECT / "docs" / "reliability.json"
README = PROJECT / "README.md"
AGAIN = ("--reruns", "3", "--only-rerun", "did not get where the test begins")
"""As in `make test`: of a live test that a stall of the machine kept from its beginning."""


def machine() -> str:
    """What the figures were measured on."""
    model = next(
        (line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line),
        platform.machine(),
    )
    python = platform.python_version()
    load = f"load {os.getloadavg()[2]:.1f} for the last quarter of an hour"
    return f"{os.cpu_count()} processors ({model}), {platform.system()} {platform.release()}, Python {python}, {load}"


def of_version() -> str:
    """Version and commit."""
    asked = ["git", "describe", "--always", "--dirty"]
    commit = subprocess.run(asked, cwd=PROJECT, capture_output=True, text=True, check=False).stdout.strip()
    return f"{version('thruster-rig')} {commit}".strip()


def run(wanted: list[Promise], short: bool) -> int:
    """Their tests, one after another, in one pytest; nothing runs beside those that measure time. Its exit status."""
    LINES.parent.mkdir(exist_ok=True)
    LINES.unlink(missing_ok=True)
    tests = sorted({test for promise in wanted for test in promise.tests})
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *AGAIN, *tests]
    environment = os.environ | {FILE: str(LINES)} | ({} if short else {"THRUSTER_RIG_RELIABILITY": "full"})
    return subprocess.run(words, cwd=PROJECT, env=environment, check=False).returncode if tests else 0


def results(page: tuple[Promise, ...], wanted: set[int], before: Path) -> dict[str, Any]:
    """All promises; those that were not asked for as the file `before` has them, when it has."""
    lines = LINES.read_text(encoding="utf-8").splitlines() if LINES.exists() else []
    date = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    found = summed(lines, page, f"{date}, version {of_version()}, {machine()}")
    known = json.loads(before.read_text(encoding="utf-8"))["promises"] if before.exists() else {}
    for promise in page:
        number = str(promise.number)
        if promise.number not in wanted and number in known:
            kept = {"promise": promise.line, "state": promise.state}
            found[number] = known[number] | kept
    return {"date": date, "version": of_version(), "machine": machine(), "promises": found}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("numbers", nargs="*", type=int)
    for option in ("--short", "--collect", "--publish"):
        parser.add_argument(option, action="store_true")
    asked = parser.parse_args()
    page = promises(PAGE.read_text(encoding="utf-8"))
    wanted = set(asked.numbers) or {promise.number for promise in page}
    ended = 0
    if not asked.collect:
        ended = run([promise for promise in page if promise.number in wanted], asked.short)
    found = results(page, wanted, PUBLISHED if asked.publish else RESULT)
    text = json.dumps(found, indent=1, ensure_ascii=False) + "\n"
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(text, encoding="utf-8")
    if asked.publish:
        PUBLISHED.write_text(text, encoding="utf-8")
        README.write_text(put(README.read_text(encoding="utf-8"), found), encoding="utf-8")
    for number, entry in found["promises"].items():
        print(f"{number:>3}  {entry['state']:<9} {told(entry)}")
    failed = [number for number, entry in found["promises"].items() if entry["tests"]["failed"]]
    print(f"promises with a failed test: {', '.join(failed) or 'none'}; {RESULT.relative_to(PROJECT)} has all figures")
    return 1 if failed else ended


if __name__ == "__main__":
    sys.exit(main())
