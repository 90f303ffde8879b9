"""The recording format: what the writer makes and refuses."""

import shutil

import h5py
import numpy as np
import pytest

from rig.errors import RecordingError
from rig.hdf5 import RecordingFile, load, recover
from rig.hdf5.layout import text_of
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec
from tests.rig.hdf5.plain_files import plain

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


def test_an_empty_batch_writes_nothing(tmp_path):
    file = written(tmp_path / "r.h5")
    file.add_rows(rows(1, [], np.empty((0, 1))))
    assert file.flush() == (2, 1)
    file.add_rows(rows(1, [], np.empty((0, 1))))
    assert file.flush() == (2, 1)
    file.close("completed", "", 2.0)


def test_a_closed_file_says_so_twice_and_its_tables_hold_no_variable_strings(tmp_path):
    path = tmp_path / "r.h5"
    written(path).close("tripped", "over-current 41 A", 2.0)
    found = []
    with h5py.File(path) as file:
        assert bool(file.attrs["complete"])
        assert file.attrs["format"] == "thruster-rig-recording"
        assert text_of(file.attrs["outcome"]) == "tripped"
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
    assert "not closed in order, or still being written" in recording.events[-1].text
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
