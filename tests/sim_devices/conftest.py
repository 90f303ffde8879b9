"""Worlds are stepped in loops of Python, which measuring coverage slows down up to five times."""

from __future__ import annotations

from pathlib import Path

import pytest

HERE = Path(__file__).parent
MEASURED = ("recorded", "vehicle")
"""Folders whose tests go through code of the rig; the others go through simulated devices alone: they have no floor."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in item.path.parents and item.path.relative_to(HERE).parts[0] not in MEASURED:
            item.add_marker(pytest.mark.no_cover)
