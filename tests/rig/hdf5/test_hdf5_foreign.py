"""The recording format: what the loader accepts from anybody."""

import json

import h5py
import numpy as np
import pytest

from rig.errors import RecordingError
from rig.hdf5 import load
from tests.rig.hdf5.plain_files import plain


def test_ten_lines_of_plain_h5py_are_a_recording(tmp_path):
    recording = load(plain(tmp_path / "r.h5", complete=True, thruster="X", outcome="completed"))
    assert recording.first_of("thrust").value.tolist() == [0.0, 1.0, 4.0]
    assert recording.first_of("command_voltage").value.dtype == np.float64
    assert (recording.kind, recording.complete, recording.outcome, recording.steps) == ("tunnel", True, "completed", ())
    assert recording.events == ()


def test_a_recording_without_complete_is_not_complete(tmp_path):
    assert not load(plain(tmp_path / "r.h5")).complete


def test_end_is_believed_before_the_root(tmp_path):
    path = plain(tmp_path / "r.h5", complete=True, outcome="completed")
    with h5py.File(path, "a") as file:
        file["end/complete"] = [False]
        file["end/outcome"] = "running"
    recording = load(path)
    assert (recording.complete, recording.outcome, recording.cause) == (False, "running", "")


def test_odd_files_load_and_say_what_was_left_out(tmp_path):
    path = plain(tmp_path / "r.h5", water_density=np.array([998.0], dtype="f4"), tags=np.array(["a", "b"], dtype="S1"))
    with h5py.File(path, "a") as file:
        file["streams/cell/counts"] = np.arange(2, dtype="i2")
        file["streams/cell/notes"] = ["a", "b", "c"]
        file["streams/cell/matrix"] = np.zeros((3, 3))
        file["streams/cell/torque"] = np.zeros(3, dtype="f4")
        file["streams/cell/torque"].attrs.update({"quantity": "torque", "unit": "Nm"})
        file["streams/cell/other"] = np.zeros(3)
        file["streams/cell/other"].attrs.update({"quantity": "thrust", "unit": "kN", "noise_std": "unknown"})
        file["streams/cell/bare"] = np.zeros(3)
        file["streams/cell/bare"].attrs["quantity"] = "current"
        file["streams/clockless/x"] = np.zeros(3)
        file["streams/loose"] = np.zeros(3)
        back = file.create_group("streams/back")
        back["time"] = [0.0, 2.0, 1.0, np.nan, 3.0]
        back["x"] = [0, 1, 2, 3, 4]
        back["x"].attrs["calibration"] = "gain 2"
        file["processed/thing"] = 1
        file["steps"] = np.zeros(3)
        file["events"] = np.array([(0.5, "x")], dtype=[("time", "f4"), ("text", "S3")])
    recording = load(path)
    named = {channel.name: channel for channel in recording.channels}
    assert named["thrust"].value.size == 2
    assert (named["torque"].quantity, named["torque"].unit) == ("torque", "N.m")
    assert (named["other"].quantity, named["other"].unit, named["other"].noise_std) == (None, "kN", None)
    assert named["bare"].unit == "A"
    assert named["x"].value.tolist() == [0, 1, 4]
    assert named["x"].calibration == {"text": "gain 2"}
    assert recording.water_density == 998.0
    said = "\n".join(event.text for event in recording.events)
    for part in ("1 were unfinished", "matrix, notes left out", "'kN' is kept", "clockless has no", "2 rows left out"):
        assert part in said
    assert "/steps is not a table" in said
    assert "/events is not a table" in said


def test_variable_strings_and_unknown_fields_in_tables_are_read(tmp_path):
    path = plain(tmp_path / "r.h5")
    text = h5py.string_dtype()
    steps = [
        ("index", "i8"),
        ("phase", text),
        ("command_voltage", "f4"),
        ("t_start", "f8"),
        ("t_end", "f8"),
        ("x", "i4"),
    ]
    with h5py.File(path, "a") as file:
        file.create_dataset("steps", data=np.array([(1, "hold", 2.0, 0.0, 1.0, 9)], dtype=steps))
        file.create_dataset(
            "events", data=np.array([(0.5, "info", "grün")], dtype=[("time", "f8"), ("level", text), ("text", text)])
        )
        file["streams/cell/thrust"].attrs["calibration"] = json.dumps([1, 2])
    recording = load(path)
    assert recording.steps[0].phase == "hold"
    assert recording.events[0].text == "grün"
    assert recording.first_of("thrust").calibration == {"value": [1, 2]}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"format": "other"}, "'other' where"),
        ({"format_version": 2}, "format_version 2; this program reads up to 1"),
        ({"format_version": "two"}, "format_version two"),
    ],
)
def test_other_files_are_refused_by_name(tmp_path, change, says):
    path = plain(tmp_path / "r.h5")
    with h5py.File(path, "a") as file:
        file.attrs.update(change)
    with pytest.raises(RecordingError, match=says):
        load(path)


def test_files_that_are_no_recordings_are_refused(tmp_path):
    with pytest.raises(RecordingError, match="is not there"):
        load(tmp_path / "r.h5")
    (tmp_path / "r.csv").write_text("a,b\n1,2\n")
    with pytest.raises(RecordingError, match=r"not an HDF5 file; `rig import`"):
        load(str(tmp_path / "r.csv"))
    path = plain(tmp_path / "r.h5")
    with h5py.File(path, "a") as file:
        del file["streams/cell"], file["streams/drive"]
    with pytest.raises(RecordingError, match="no stream in it"):
        load(path)
    with h5py.File(path, "a") as file:
        del file["streams"]
    with pytest.raises(RecordingError, match="no group /streams"):
        load(path)


def test_a_file_cut_short_is_refused_with_a_sentence(tmp_path):
    path = plain(tmp_path / "r.h5")
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(RecordingError, match="can't be opened"):
        load(path)
