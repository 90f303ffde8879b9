"""What excuses a late stop must itself be right: only time in which the metronome too was held up."""

from __future__ import annotations

import json

import pytest

from tests.reliability.live import NOT_BEGUN
from tests.reliability.metronome import longest, stalled
from tests.reliability.numbers_measured import keep


@pytest.fixture
def late_wakes(tmp_path):
    """The machine stood still from 1.00 to 1.10 s and from 1.18 to 1.30 s."""
    file = tmp_path / "late"
    file.write_text("1000000000 1100000000\n1180000000 1300000000\n")
    return file


@pytest.mark.parametrize(
    ("since", "until", "held_up"), [(0.9, 1.0, 0.0), (0.9, 1.2, 0.12), (1.05, 1.07, 0.02), (0.0, 9.0, 0.22)]
)
def test_stalled(late_wakes, since, until, held_up):
    assert stalled(late_wakes, round(since * 1e9), round(until * 1e9)) == pytest.approx(held_up)
    assert longest(late_wakes, 0, 9_000_000_000) == pytest.approx(0.12)


def test_prompt(prompt):
    prompt(0.10, 0.1, 2_000_000_000)
    with pytest.raises(AssertionError, match=NOT_BEGUN):
        prompt(0.15, 0.1, 990_000_000)
    with pytest.raises(AssertionError, match=r"assert 0\.4 <= 0\.1"):
        prompt(0.4, 0.1, 990_000_000)
    with pytest.raises(AssertionError, match=r"assert 0\.15 <= 0\.1"):
        prompt(0.15, 0.1, 2_000_000_000)


def test_numbers_of_two_processes_are_kept_together(tmp_path):
    """Each worker of pytest-xdist leaves its own; those of an earlier session go."""
    (tmp_path / "results.json").write_text('{"old": {}}')
    for number in ({"a": {"value": 1.0}}, {"b": {"value": 2.0}, "c": {"value": 3.0}}):
        keep(number, tmp_path / "session.json", tmp_path / "results.json")
    assert list(json.loads((tmp_path / "results.json").read_text())) == ["a", "b", "c"]
