"""Live tests: a metronome beside them tells whether the machine kept time."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.reliability.live import NOT_BEGUN
from tests.reliability.machine.metronome import longest, metronome, stalled

HERE = Path(__file__).parent
LATE_WAKES = pytest.StashKey[Path]()
TRIPS = 0.1
"""s: from two of these in a row on a run ends tripped, as it should (a loop 0.25 s late, a sample 0.2 s old)."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """They measure how late things happen: two at once, each of a third of a core, and nothing else."""
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.alone)


@pytest.fixture(scope="session", autouse=True)
def late_wakes(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Path]:
    file = tmp_path_factory.mktemp("metronome") / "late"
    request.config.stash[LATE_WAKES] = file
    with metronome(file):
        yield file


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, Any, Any]:
    """A test that failed on a machine that stood still has tried the machine: it may begin once more."""
    report = yield
    file = item.config.stash.get(LATE_WAKES, None)
    if call.when == "call" and report.failed and item.path.parent == HERE and file is not None:
        now = time.monotonic_ns()
        held_up = longest(file, now - round(call.duration * 1e9), now)
        crash = getattr(report.longrepr, "reprcrash", None)
        if held_up > TRIPS and crash is not None:
            crash.message = f"{NOT_BEGUN}: the machine stood still for {held_up:.2f} s; {crash.message}"
    return report


@pytest.fixture
def prompt(late_wakes: Path) -> Callable[[float, float, int], None]:
    """Fail when a `latency` from `since_ns` on exceeds what is `allowed`, both in s. When it would not have without the
    time that a process with nothing to do was held up as well, nothing was tried: the test may begin once more."""

    def judge(latency: float, allowed: float, since_ns: int) -> None:
        held_up = stalled(late_wakes, since_ns, since_ns + round(latency * 1e9))
        if latency > allowed >= latency - held_up:
            raise AssertionError(f"{NOT_BEGUN}: the machine stood still for {held_up:.3f} s of {latency:.3f} s")
        assert latency <= allowed

    return judge
