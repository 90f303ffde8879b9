"""What excuses a late stop must itself be right: only time in which the metronome too was held up."""

from __future__ import annotations

import pytest

from tests.reliability.live import NOT_BEGUN
from tests.reliability.machine.metronome import longest, stalled


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
