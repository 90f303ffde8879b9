"""Each promise leaves its measured number in build/reliability.json, which the README quotes."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

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
