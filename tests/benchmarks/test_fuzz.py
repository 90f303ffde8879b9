"""benchmarks/fuzz.py at the size of a test: seconds of what it does for hours."""

import pytest

from benchmarks.fuzzing import decoders, files, sockets
from benchmarks.fuzzing.command_line import attempt
from benchmarks.fuzzing.mutation import Tally


def whole(tallies: list[Tally]) -> None:
    assert [line for tally in tallies for line in tally.hurt] == []


def test_no_line_or_frame_hurts_a_decoder(tmp_path):
    whole(decoders.run(1000, 7, tmp_path))


@pytest.mark.timeout(120)
def test_no_recording_hurts_the_command_line(tmp_path):
    found = files.run_recordings(9, 7, tmp_path)
    whole(found)
    assert sum(tally.outcomes.get("status 2", 0) for tally in found) > 0


@pytest.mark.timeout(120)
def test_no_toml_hurts_the_command_line(tmp_path):
    whole(files.run_tomls(9, 7, tmp_path))


def test_no_flood_holds_the_controller_up(tmp_path):
    whole(sockets.run(600, 7, tmp_path))


def test_what_hurts_is_found_and_kept(tmp_path):
    made = attempt(["--no-such-option"], tmp_path)
    assert (made.status, made.wrong) == (2, "")
    tally = Tally("x", tmp_path)
    tally.fail("x.bin", "because", b"data")
    assert (tmp_path / "x.bin").read_bytes() == b"data"
    assert "x.bin: because" in tally.summary()
    assert decoders.infinite([(1.0, float("-inf"))])
