"""Each promise leaves its measured number in build/reliability.json, which the README quotes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.reliability.live import NOT_BEGUN
from tests.reliability.metronome import metronome, stalled

RESULTS = Path(__file__).parents[2] / "build" / "reliability.json"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """They measure how late things happen: nothing else may run beside them."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.alone)


@pytest.fixture(scope="session")
def measured() -> Iterator[dict[str, dict[str, float | str]]]:
    numbers: dict[str, dict[str, float | str]] = {}
    yield numbers
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(numbers, indent=1) + "\n")


@pytest.fixture
def report(measured: dict[str, dict[str, float | str]]) -> Callable[[str, float, str], None]:
    """Keep a measured number under its name."""

    def keep(name: str, value: float, unit: str) -> None:
        measured[name] = {"value": round(value, 4), "unit": unit}

    return keep


@pytest.fixture(scope="session")
def late_wakes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    file = tmp_path_factory.mktemp("metronome") / "late"
    with metronome(file):
        yield file


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
