"""`rig recover`: odd files that were never closed, and the command."""

import shutil

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from rig.errors import RecordingError
from rig.hdf5 import load
from rig.hdf5.write import RecordingFile
from rig.link.recorder_messages import ChannelSpec, Rows, StreamSpec
from rig.recording.ledger import Ledger
from rig.recording.recover import recover_command


def left_open(path, fill):
    """A file of another program in SWMR mode, as its death leaves it."""
    live = path.with_suffix(".live")
    with h5py.File(live, "w", libver=("v110", "v110")) as file:
        file.attrs.update({"format": "thruster-rig-recording", "format_version": 1, "thruster": "T9"})
        fill(file)
        file.swmr_mode = True
        file.flush()
        shutil.copy(live, path)
    return path


def uneven(file):
    cell = file.create_group("streams/cell")
    cell.attrs["source"] = "theirs"
    cell["time"] = np.arange(5) * 0.1
    cell["thrust"] = np.arange(4.0)
    cell["thrust"].attrs.update({"quantity": "thrust", "unit": "N"})
    short = file.create_group("streams/short")
    short["x"] = np.arange(3)
    file.create_group("streams/empty")
    file["calibration/table"] = np.eye(2)


def test_an_uneven_file_is_cut_and_the_loss_is_said(tmp_path):
    path = left_open(tmp_path / "r.h5", uneven)
    done = CliRunner().invoke(recover_command, [str(path)], catch_exceptions=False)
    assert done.exit_code == 0
    assert "cell: 4 rows kept; 1 unfinished rows left out; at most 5 more had come after the last flush" in done.output
    assert "short: 3 rows kept; 0 unfinished rows left out; at most 0 more" in done.output
    copy = tmp_path / "r-recovered.h5"
    recording = load(copy)
    assert (recording.thruster, recording.complete, recording.attributes["opened_as"]) == ("T9", False, "plain")
    assert recording.first_of("thrust").value.tolist() == [0, 1, 2, 3]
    with h5py.File(copy) as file:
        assert np.array_equal(file["calibration/table"], np.eye(2))
    again = CliRunner().invoke(recover_command, [str(path)])
    assert isinstance(again.exception, RecordingError)


def test_a_file_whose_closing_was_cut_off_keeps_its_outcome(tmp_path):
    def closed(file):
        uneven(file)
        file["end/outcome"] = np.array([b"completed"], dtype="S16")
        file["end/complete"] = [True]

    path = left_open(tmp_path / "r.h5", closed)
    out = tmp_path / "o.h5"
    CliRunner().invoke(recover_command, [str(path), "-o", str(out)], catch_exceptions=False)
    recording = load(out)
    assert (recording.complete, recording.outcome) == (True, "completed")


def test_cause_of_a_recorder_that_was_killed_is_taken_from_the_ledger(tmp_path):
    streams = (StreamSpec("cell", "theirs", (ChannelSpec("thrust", "thrust", "N"),)),)
    live, path, out = tmp_path / "live", tmp_path / "T9-2.h5", tmp_path / "o.h5"
    file = RecordingFile(live, {"thruster": "T9"}, streams, 0)
    file.add_rows(Rows(0, np.arange(3) * 10**8, np.ones((3, 1))))
    file.flush()
    shutil.copy(live, path)
    file.close("aborted", "a test", 1.0)
    ledger = Ledger.open(tmp_path, at_once=True)
    end = {"thruster": "T9", "outcome": "tripped", "sha256": "", "time_to_zero_s": None}
    ledger.write("run_end", **end, cause="of another file", recording="/there/T9.h5")
    ledger.write("run_end", **end, cause="recorder: the recorder process has ended", recording="/there/T9-2.h5")
    ledger.close()
    CliRunner().invoke(recover_command, [str(path), "-o", str(out)], catch_exceptions=False)
    recording = load(out)
    assert (recording.complete, recording.outcome) == (False, "tripped")
    assert load(path).cause == ""
    told = "recorder: the recorder process has ended; recovered from T9-2.h5, which was not closed in order"
    assert recording.cause == told
    assert any(event.text == told for event in recording.events)
    (tmp_path / "campaign.jsonl").write_text("hello\n")
    out.unlink()
    said = CliRunner().invoke(recover_command, [str(path), "-o", str(out)], catch_exceptions=False)
    assert "how the run ended is not taken from its ledger" in said.output
    assert load(out).cause == "recovered from T9-2.h5, which was not closed in order"


def test_what_is_no_recording_is_not_recovered(tmp_path):
    (tmp_path / "r.h5").write_text("no")
    result = CliRunner().invoke(recover_command, [str(tmp_path / "r.h5")])
    assert isinstance(result.exception, RecordingError)
    with pytest.raises(RecordingError):
        load(tmp_path / "r.h5")
