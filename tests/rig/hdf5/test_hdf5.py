"""The recording format: what the writer makes, and what the loader accepts from anybody."""

import json
import shutil

import h5py
import numpy as np
import pytest

from rig.errors import RecordingError
from rig.hdf5 import RecordingFile, load, recover
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec

CELL = StreamSpec(
    "load_cell",
    "mt_sics",
    (
        ChannelSpec("thrust", "thrust", "N", noise_std=0.02, range_max=300.0, calibration='{"role": "primary"}'),
        ChannelSpec("raw", None, "1", integer=True, description="counts"),
    ),
    device_id="WMS 123",
)
COMMAND = StreamSpec("command", "rig", (ChannelSpec("command_voltage", "command_voltage", "V"),))


def rows(stream, t_ns, values):
    return Rows(stream, np.array(t_ns), np.array(values, dtype=float))


def written(path, **attributes):
    file = RecordingFile(path, {"recording_id": "id", "thruster": "T1", **attributes}, (CELL, COMMAND), t0_ns=1_000)
    file.add_rows(rows(0, [1_000, 2_000_001_000], [[1.0, 7], [2.0, np.nan]]))
    file.add_rows(rows(1, [1_000], [[5.0]]))
    file.add_step(StepRow(0, "hold", 5.0, 0.0, 2.0))
    file.add_event(EventRow(0.5, "info", "tare 1.25 N"))
    return file


def plain(path, **root):
    """What somebody else writes: ten lines of plain h5py."""
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "thruster-rig-recording", "format_version": 1, **root})
        for stream, quantity, unit, values in (
            ("drive", "command_voltage", "V", [0, 1, 2]),
            ("cell", "thrust", "N", [0.0, 1.0, 4.0]),
        ):
            group = file.create_group(f"streams/{stream}")
            group["time"] = np.arange(3.0)
            group[quantity] = values
            group[quantity].attrs.update({"quantity": quantity, "unit": unit})
    return path


def test_what_is_written_is_loaded(tmp_path):
    path = tmp_path / "r.h5"
    file = written(path, water_density=999.0, bench_toml="[bench]\n" * 10_000, kind="bollard", integer=3)
    assert file.flush() == (2, 1)
    file.close("completed", "", 2.0)
    recording = load(path)
    thrust, raw, command = recording.channels
    assert thrust.time.tolist() == [0.0, 2.0]
    assert (thrust.noise_std, thrust.range_max, thrust.range_min) == (0.02, 300.0, None)
    assert thrust.calibration == {"role": "primary"}
    assert recording.first_of("thrust") is thrust
    assert raw.value[0] == 7
    assert np.isnan(raw.value[1])
    assert raw.description == "counts"
    assert command.value.tolist() == [5.0]
    assert (recording.recording_id, recording.thruster, recording.kind) == ("id", "T1", "bollard")
    assert (recording.complete, recording.outcome, recording.water_density) == (True, "completed", 999.0)
    assert recording.attributes["opened_as"] == "plain"
    assert recording.attributes["bench_toml"] == "[bench]\n" * 10_000
    assert recording.attributes["integer"] == 3
    assert recording.attributes["streams"]["load_cell"]["device_id"] == "WMS 123"
    assert [step.phase for step in recording.steps] == ["hold"]
    assert [event.text for event in recording.events] == ["tare 1.25 N"]


def test_a_closed_file_says_so_twice_and_its_tables_hold_no_variable_strings(tmp_path):
    path = tmp_path / "r.h5"
    written(path).close("tripped", "over-current 41 A", 2.0)
    found = []
    with h5py.File(path) as file:
        assert bool(file.attrs["complete"])
        assert file.attrs["format"] == "thruster-rig-recording"
        assert file.attrs["outcome"] == "tripped"
        assert file["streams/load_cell/thrust"].attrs["unit"] == "N"
        assert bool(file["end/complete"][0])
        assert file["end/cause"][0] == b"over-current 41 A"
        file.visititems(lambda name, item: found.append(item))
        kinds = [item.dtype.kind for item in found if isinstance(item, h5py.Dataset)]
        assert "O" not in kinds
        assert file["streams/load_cell/raw"].dtype == np.int64
    assert load(path).cause == "over-current 41 A"


def test_rows_that_run_back_are_dropped_and_counted(tmp_path):
    path = tmp_path / "r.h5"
    file = written(path)
    file.flush()
    file.add_rows(
        rows(0, [2_000_000_999, 2_000_001_000, 3_000_001_000, 2_500_000_000], [[9, 9], [3, 3], [4, 4], [9, 9]])
    )
    file.add_rows(rows(1, [500, 900], [[9.0], [9.0]]))
    file.close("completed", "", 3.0)
    recording = load(path)
    assert recording.channels[0].value.tolist() == [1, 2, 3, 4]
    texts = [event.text for event in recording.events]
    assert "load_cell: 2 rows dropped, older than the row before them" in texts
    assert "command: 2 rows dropped, older than the row before them" in texts


def test_a_long_event_becomes_several_rows_and_loses_nothing(tmp_path):
    path = tmp_path / "r.h5"
    file = written(path)
    note = "a" + "ü" * 700
    file.add_event(EventRow(1.0, "info", note))
    file.close("completed", "ü" * 400, 2.0)
    recording = load(path)
    assert "".join(event.text for event in recording.events[1:]) == note
    assert recording.cause == "ü" * 256


@pytest.mark.parametrize(
    ("attributes", "streams", "says"),
    [
        ({"complete": True}, (), "complete"),
        ({}, (CELL, CELL), "load_cell"),
        ({}, (StreamSpec("s", "x", (ChannelSpec("time", None, "s"),)),), "time"),
        ({}, (StreamSpec("a/b", "x", ()),), "a/b"),
        ({}, (StreamSpec("s", "x", (ChannelSpec("f", "thrust", "N", calibration="gain 2"),)),), "not JSON"),
        ({}, (StreamSpec("s", "x", (ChannelSpec("f", "thrust", "N", calibration="[2]"),)),), "JSON object"),
    ],
)
def test_a_layout_that_cannot_be_is_refused_before_the_file_is_made(tmp_path, attributes, streams, says):
    with pytest.raises(RecordingError, match=says):
        RecordingFile(tmp_path / "r.h5", attributes, streams, 0)
    assert not (tmp_path / "r.h5").exists()


def test_a_recording_is_never_overwritten(tmp_path):
    plain(tmp_path / "r.h5")
    with pytest.raises(RecordingError, match="cannot create"):
        RecordingFile(tmp_path / "r.h5", {}, (CELL,), 0)


def test_rows_that_do_not_fit_are_refused(tmp_path):
    file = written(tmp_path / "r.h5")
    with pytest.raises(RecordingError, match="has 2 channels"):
        file.add_rows(rows(0, [5_000_000_000], [[1.0]]))
    with pytest.raises(RecordingError, match="stream 7 of 2"):
        file.add_rows(rows(7, [1], [[1.0]]))
    file.close("aborted", "", 0.0)


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


def test_a_file_that_was_never_closed_is_read_and_recovered(tmp_path):
    written_to, path = tmp_path / "w.h5", tmp_path / "r.h5"
    file = written(written_to)
    file.flush()
    shutil.copy(written_to, path)  # what a crash leaves
    file.close("completed", "", 2.0)
    before = path.read_bytes()
    recording = load(path)
    assert recording.attributes["opened_as"] == "swmr"
    assert (recording.complete, recording.outcome) == (False, "running")
    assert recording.first_of("thrust").value.size == 2
    assert "opened in SWMR mode" in recording.events[-1].text
    losses = recover(path, tmp_path / "copy.h5")
    assert [(loss.stream, loss.kept, loss.unfinished, loss.unflushed) for loss in losses] == [
        ("load_cell", 2, 0, 1),
        ("command", 1, 0, 0),
    ]
    assert path.read_bytes() == before
    copy = load(tmp_path / "copy.h5")
    assert copy.attributes["opened_as"] == "plain"
    assert (copy.complete, copy.outcome, copy.recording_id) == (False, "aborted", "id")
    assert copy.cause == "recovered from r.h5, which was not closed in order"
    assert [channel.name for channel in copy.channels] == ["thrust", "raw", "command_voltage"]
    assert copy.channels[0].calibration == {"role": "primary"}
    assert copy.steps == recording.steps
    assert [event.text for event in copy.events][:2] == ["tare 1.25 N", copy.cause]
    assert copy.events[2].text.startswith("load_cell: 2 rows kept; 0 unfinished")
    with pytest.raises(RecordingError, match="nothing to recover"):
        recover(written_to, tmp_path / "other.h5")
    with pytest.raises(RecordingError, match="never overwritten"):
        recover(path, tmp_path / "copy.h5")
