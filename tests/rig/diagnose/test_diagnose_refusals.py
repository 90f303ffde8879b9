"""rig diagnose, simulate and compare: input that cannot be used is one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.rig.diagnose.diagnosed_files import bad, run


def refused(folder: Path, *arguments: object) -> str:
    result = run("diagnose", *arguments)
    assert result.exit_code == 2, result.output
    lines = result.output.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (bad.without_thrust, "has no thrust channel"),
        (bad.without_command, "nothing tells what drove the thruster"),
        (bad.constant, "at least two levels are needed"),
        (bad.twenty, "has 20 thrust samples, at least 50 are needed"),
        (bad.all_nan, "has 0 finite thrust samples"),
        (bad.other_clock, "are both on one clock?"),
    ],
)
def test_a_recording_that_cannot_be_used_is_one_sentence(tmp_path, change, words):
    assert words in refused(tmp_path, bad.recording(tmp_path / "it.h5", change=change))


def test_files_that_are_not_what_is_asked_for(tmp_path, dead):
    (tmp_path / "notes.h5").write_text("good weather")
    assert "is not an HDF5 file" in refused(tmp_path, tmp_path / "notes.h5")
    assert "is not there" in refused(tmp_path, tmp_path / "nowhere.h5")
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "a folder without recordings" in refused(tmp_path, empty)
    other = bad.recording(tmp_path / "T2.h5", "T2", 2)
    assert "several thrusters (T1, T2)" in refused(tmp_path, dead[0], other)
    assert "given twice" in refused(tmp_path, dead[0], dead[0])
    assert "hold out a recording of T1" in refused(tmp_path, dead[0], "--holdout", other)
    assert "the twin is of thruster T1" in refused(tmp_path, other, "--twin", dead[2])
