"""Files that were made to harm: none is followed out of itself, and none takes time or memory that its size does not
justify.
"""

import errno
import os
import signal
from pathlib import Path

import h5py
import numpy as np
import pytest

from rig.errors import RecordingError, UnreadError
from rig.hdf5 import is_hdf5, load, recording_id_of, recover
from rig.hdf5.apart import apart, open_no_more


def made(path, rows=100):
    """A small recording of another program."""
    with h5py.File(path, "w") as file:
        file.attrs.update({"format": "thruster-rig-recording", "format_version": 1, "recording_id": "id"})
        cell = file.create_group("streams/cell")
        cell["time"] = np.arange(rows) * 0.1
        cell["thrust"] = np.arange(float(rows))
        cell["thrust"].attrs.update({"quantity": "thrust", "unit": "N"})
    return path


def names(path):
    return {f"{channel.stream}/{channel.name}" for channel in load(path).channels}


def test_nothing_is_read_from_another_file_or_through_a_loop(tmp_path):
    other, path = made(tmp_path / "other.h5"), made(tmp_path / "r.h5")
    layout = h5py.VirtualLayout((100,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "streams/cell/thrust", (100,))
    with h5py.File(path, "r+") as file:
        streams = file["streams"]
        streams["elsewhere"] = h5py.ExternalLink(str(other), "/streams/cell")
        streams["round"] = h5py.SoftLink("/streams/back")
        streams["back"] = h5py.SoftLink("/streams/round")
        streams["twice"] = h5py.SoftLink("/streams/elsewhere")
        streams["cell"].create_virtual_dataset("virtual", layout)
        streams["cell"]["linked"] = h5py.ExternalLink(str(other), "/streams/cell/thrust")
        file["events"] = h5py.ExternalLink(str(other), "/streams/cell/thrust")
        file["end"] = h5py.ExternalLink(str(other), "/streams")
    assert names(path) == {"cell/thrust"}
    assert any("linked, virtual left out" in event.text for event in load(path).events)


@pytest.mark.parametrize("link", [h5py.SoftLink("/streams"), h5py.ExternalLink("/dev/zero", "/streams")])
def test_streams_that_stand_elsewhere_are_none(tmp_path, link):
    path = made(tmp_path / "r.h5")
    with h5py.File(path, "r+") as file:
        file.move("streams", "s")
        file["streams"] = link
    with pytest.raises(RecordingError, match="no group /streams"):
        load(path)


def bomb(path, rows):
    made(path)
    with h5py.File(path, "r+") as file:
        cell = file.create_group("streams/bomb")
        for name in ("time", *"abcdef"):
            cell.create_dataset(name, (rows,), "f8", chunks=(2**20,), compression="gzip", fillvalue=0.0)[...] = 0.0
    return path


def test_what_is_packed_a_thousandfold_takes_no_more_memory_than_the_file_justifies(tmp_path):
    path = bomb(tmp_path / "r.h5", 12 * 2**20)
    assert path.stat().st_size < 2**20
    try:
        recording = load(path)
    except RecordingError as error:
        assert "more memory is needed to read the recording than its size justifies" in str(error)  # noqa: PT017
    else:  # where times find room and values do not
        left = [event.text for event in recording.events if "left out, for it can't be read" in event.text]
        assert left
        assert sum(channel.stream == "bomb" for channel in recording.channels) == len("abcdef") - len(left)


def test_tables_of_any_declared_size_are_left_out(tmp_path):
    path = made(tmp_path / "r.h5")
    kind = np.dtype([("time", "f8"), ("level", "S8"), ("text", "S512")])
    with h5py.File(path, "r+") as file:
        file.create_dataset("events", (10**11,), kind, chunks=(64,))
        file.create_dataset("end/outcome", (10**11,), "S16", chunks=(64,))
        file["steps"] = np.zeros(3, [("index", "i4"), ("phase", "S8")])
    recording = load(path)
    assert recording.steps == ()
    assert any("/events can't be read" in event.text for event in recording.events)


def test_odd_attributes_are_no_reason_to_fail(tmp_path):
    path = made(tmp_path / "r.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["reference"] = file["streams"].ref
        file.attrs["empty"] = h5py.Empty("f8")
        file.attrs["many"] = [1.0, 2.0]
        file["streams/cell/thrust"].attrs["calibration"] = "[" * 100_000
        file["streams/cell/thrust"].attrs["noise_std"] = np.inf
    recording = load(path)
    assert recording.attributes["many"] == [1.0, 2.0]
    assert "text" in recording.channels[0].calibration
    assert recording.channels[0].noise_std is None


def test_arrays_of_an_answer_are_as_they_were_and_can_not_be_written(tmp_path):
    recording = load(made(tmp_path / "r.h5", 1001))
    (channel,) = recording.channels
    assert np.array_equal(channel.value, np.arange(1001.0))
    assert np.array_equal(channel.time, np.arange(1001) * 0.1)
    with pytest.raises(ValueError, match="read-only"):
        channel.value[0] = 1.0
    assert recording_id_of(tmp_path / "r.h5") == "id"


def test_whatever_reading_does_this_process_goes_on(tmp_path):
    path = made(tmp_path / "r.h5")

    def killed():
        os.kill(os.getpid(), signal.SIGSEGV)

    def endless():
        while True:
            pass

    def opening():
        open_no_more()
        return path.read_bytes()

    for work, said in (
        (killed, "HDF5 ended with SIGSEGV"),
        (endless, "takes more than 6 s"),
        (lambda: bytearray(10**10), "more memory is needed"),
    ):
        with pytest.raises(RecordingError, match=said):
            apart(work, path)
    with pytest.raises(RuntimeError, match="Too many open files"):
        apart(opening, path)
    assert apart(lambda: 5, path) == 5


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP])
def test_a_reader_that_somebody_ends_says_nothing_of_the_file(tmp_path, by):
    path = made(tmp_path / "r.h5")
    with pytest.raises(UnreadError, match=rf"r\.h5 was not read: its process was ended from outside \({by.name}"):
        apart(lambda: os.kill(os.getpid(), by), path)


def test_a_reader_that_waits_says_nothing_of_the_file(tmp_path, monkeypatch):
    monkeypatch.setattr("rig.hdf5.apart.PATIENCE", 0.02)
    path = made(tmp_path / "r.h5")
    with pytest.raises(UnreadError, match=r"was not read within 0\.12 s: its disk or this machine is slow"):
        apart(signal.pause, path)


def test_no_process_to_read_with_says_nothing_of_the_file(tmp_path, monkeypatch):
    path, before = made(tmp_path / "r.h5"), len(list(Path("/proc/self/fd").iterdir()))

    def refused():
        raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr(os, "fork", refused)
    with pytest.raises(UnreadError, match=r"no process is to be had for it \(Resource temporarily unavailable"):
        load(path)
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_what_can_not_be_read_is_said(tmp_path):
    path = made(tmp_path / "r.h5")
    path.chmod(0)
    if os.access(path, os.R_OK):  # root reads everything
        path.unlink()
        os.mkfifo(path)
        assert not is_hdf5(path)
    with pytest.raises(RecordingError, match=r"can't be read|is not there"):
        load(path)
    with pytest.raises(RecordingError, match=r"can't be read|is not there"):
        recover(path, tmp_path / "out.h5")
