"""What tests measure, and how they end, one JSON object a line in the file that THRUSTER_RIG_MEASURED names.

A plugin of pytest. Numbers travel with the report of their test, so that workers of pytest-xdist need no file; those of
a test that is begun once more, because the machine stood still, are left out.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

FILE: Final = "THRUSTER_RIG_MEASURED"
FULL: Final = os.environ.get("THRUSTER_RIG_RELIABILITY") == "full"
"""`make reliability`: as often as the promises say; `make test`: a short form of it."""


def times(short: int, full: int) -> int:
    """How often a promise is tried."""
    return full if FULL else short


@pytest.fixture
def report(record_property: Callable[[str, object], None]) -> Callable[[str, float, str], None]:
    """Note a number that this test measured; the same name again is one more of the same."""

    def note(what: str, value: float, unit: str) -> None:
        record_property("measured", {"what": what, "value": round(float(value), 6), "unit": unit})

    return note


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """In the process that collects the reports only; one line for the outcome, one for each number."""
    path = os.environ.get(FILE)
    if path is None or "PYTEST_XDIST_WORKER" in os.environ or report.outcome not in ("passed", "failed"):
        return
    if report.when != "call" and report.outcome == "passed":
        return
    test = report.nodeid.split("[")[0]
    lines = [{"test": test, "outcome": report.outcome}]
    lines += [{"test": test, **value} for key, value in report.user_properties if key == "measured"]
    Path(path).parent.mkdir(exist_ok=True)
    with Path(path).open("a", encoding="utf-8") as file:
        file.write("".join(json.dumps(line) + "\n" for line in lines))
