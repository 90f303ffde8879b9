"""A few cells of the kill matrix; all 324 of them: benchmarks/controller/kill_matrix.py."""

from __future__ import annotations

import pytest

from tests.reliability.kills.kill_cells import NotBegun
from tests.reliability.kills.kill_matrix import try_cell
from tests.reliability.live import NOT_BEGUN

pytestmark = [pytest.mark.reliability, pytest.mark.timeout(180)]


@pytest.mark.parametrize(
    ("cell", "outcome"),
    [
        (("watcher", "KILL", "hold"), "completed"),
        (("headless", "INT2", "ramp"), "aborted"),
        (("recorder", "KILL", "between"), "tripped"),
    ],
    ids=lambda value: "/".join(value) if isinstance(value, tuple) else value,
)
def test_cell(tmp_path, late_wakes, cell, outcome):
    try:
        found = try_cell(tmp_path, *cell, 1, late_wakes)
    except NotBegun as error:
        raise AssertionError(f"{NOT_BEGUN}: {error}") from error
    assert found.faults == ()
    assert found.outcome == outcome, found.cause
