"""A short day at the console, by keys alone, on a terminal of tmux with a real controller and a simulated bench; the
whole one is benchmarks/day.py."""

from __future__ import annotations

import pytest

from benchmarks.operating.at_keys import Transcript
from benchmarks.operating.one_day import Day
from benchmarks.operating.preparing import at_work
from benchmarks.operating.tmux import there_is_tmux

pytestmark = [
    pytest.mark.alone,
    pytest.mark.timeout(300),
    pytest.mark.skipif(not there_is_tmux(), reason="no tmux on this machine (Debian: apt install tmux)"),
]


def test_a_thruster_with_a_cable_pulled_a_note_a_pause_a_step_again_a_bad_point_and_a_stop(tmp_path):
    transcript = Transcript(tmp_path / "day.txt")
    with at_work(tmp_path, transcript, 2.0) as (_, operator, place):
        day = Day(operator, place, ("T2",), options="--no-report")
        day.preflight()
        day.first_thruster()
        day.stop()
    text = transcript.path.read_text(encoding="utf-8")
    assert text.count("by the truth log: command 0 V") == 2
    for key in ("F5", "n", "p", "r", "t", "m", "F9", "d"):
        assert f"desk: {key}  --" in text
