"""From the lines that tests left (measured.py) to `reliability.json`, and from that to the table of the README."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from statistics import median
from typing import Any, Final

from tests.reliability.page.promises_page import Promise

BEGIN: Final = "<!-- what `make reliability` measured -->"
END: Final = "<!-- end of it -->"
SHOWN: Final = 3
"""Quantities of a promise in the table; all of them are in the JSON."""
TABLE: Final = re.compile(f"{re.escape(BEGIN)}\n.*?{re.escape(END)}", re.DOTALL)


def summed(lines: Iterable[str], page: Sequence[Promise], where: str = "") -> dict[str, dict[str, Any]]:
    """By number of the promise: its line and state, tests by outcome, count, median and worst of what they measured.

    `where`: date, version and machine of it."""
    outcomes: dict[str, list[str]] = defaultdict(list)
    numbers: dict[str, dict[tuple[str, str], list[float]]] = defaultdict(lambda: defaultdict(list))
    for line in lines:
        found = json.loads(line)
        if "outcome" in found:
            outcomes[found["test"]].append(found["outcome"])
        else:
            numbers[found["test"]][found["what"], found["unit"]].append(found["value"])
    return {str(promise.number): _entry(promise, outcomes, numbers, where) for promise in page}


def _entry(
    promise: Promise,
    outcomes: Mapping[str, list[str]],
    numbers: Mapping[str, Mapping[tuple[str, str], list[float]]],
    where: str,
) -> dict[str, Any]:
    ran = [test for test in outcomes if any(test == each or test.startswith(f"{each}::") for each in promise.tests)]
    ends = [end for test in ran for end in outcomes[test]]
    tried = {each for each in promise.tests if any(test == each or test.startswith(f"{each}::") for test in ran)}
    measured = [
        {"what": what, "unit": unit, "count": len(values), "median": median(values), "worst": max(values)}
        for test in ran
        for (what, unit), values in numbers.get(test, {}).items()
    ]
    return {
        "promise": promise.line,
        "state": promise.state,
        "run": where if ran else "",
        "tests": {
            "passed": ends.count("passed"),
            "failed": ends.count("failed"),
            "not run": len(promise.tests) - len(tried),
        },
        "measured": measured,
    }


def table(results: Mapping[str, Any]) -> str:
    """The README's rows between their two marks."""
    rows = [f"| {number} | {entry['promise']} | {told(entry)} | {state(entry)} |" for number, entry in _sorted(results)]
    newest = f"{results['date']}, version {results['version']}, {results['machine']}"
    head = f"Newest figures: {newest}. [The file](docs/reliability.json) says of each when and on what it was measured."
    return "\n".join([BEGIN, head, "", "| | promise | measured | state |", "|---|---|---|---|", *rows, END])


def put(readme: str, results: Mapping[str, Any]) -> str:
    """The README with this table in place of the one that it has. ValueError: it has no place for one."""
    if len(TABLE.findall(readme)) != 1:
        raise ValueError(f"README.md: expected one table between {BEGIN} and {END}")
    return TABLE.sub(lambda _: table(results), readme)


def _sorted(results: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    return sorted(results["promises"].items(), key=lambda item: int(item[0]))


def state(entry: Mapping[str, Any]) -> str:
    return "**FAILED**" if entry["tests"]["failed"] else str(entry["state"])


def told(entry: Mapping[str, Any]) -> str:
    """What was measured, in words; without a number how many tests passed."""
    parts = [_quantity(each) for each in entry["measured"][:SHOWN]]
    if len(entry["measured"]) > SHOWN:
        parts.append(f"{len(entry['measured']) - SHOWN} more")
    counts = entry["tests"]
    if not parts and counts["passed"]:
        parts.append(f"{counts['passed']} tests passed")
    if counts["failed"]:
        parts.append(f"{counts['failed']} of {counts['failed'] + counts['passed']} tests failed")
    if not parts:
        return "" if entry["state"] == "not done" else "not run"
    return "; ".join(parts)


def _quantity(each: Mapping[str, Any]) -> str:
    figure = figured(each["worst"], each["unit"])
    if each["count"] == 1:
        return f"{each['what']}: {figure}"
    return f"{each['what']}: {each['count']}, median {figured(each['median'], each['unit'])}, worst {figure}"


def figured(value: float, unit: str) -> str:
    """Three digits; below 10 s in ms."""
    if unit == "s" and abs(value) < 10.0:
        return f"{1e3 * value:.4g} ms" if abs(value) >= 0.1 else f"{1e3 * value:.3g} ms"
    return f"{value:.4g} {unit}".strip()
