"""Headers of many recordings in one child: what `load` says, also of odd files, and whoever ends the child is named."""

import os
import signal

import h5py
import pytest

from rig.errors import RecordingError
from rig.hdf5 import header as header_module
from rig.hdf5 import headers, headers_in_batches, load
from rig.hdf5.apart import all_apart
from rig.hdf5.header import Header
from tests.rig.hdf5.test_hdf5_damaged import written
from tests.rig.hdf5.test_hdf5_strangers import bomb, made


def odd(path, change):
    with h5py.File(made(path), "r+") as file:
        change(file)
    return path


def links(file):
    file["streams/elsewhere"] = h5py.ExternalLink("/dev/zero", "/streams/cell")
    file["streams/cell/linked"] = h5py.ExternalLink("/dev/zero", "/streams/cell/thrust")
    file["end"] = h5py.ExternalLink("/dev/zero", "/streams")
    file["streams/round"] = h5py.SoftLink("/streams")


def end(file):
    file.attrs["outcome"], file.attrs["complete"] = "aborted", False
    file["end/complete"], file["end/outcome"], file["end/cause"] = [1], ["tripped"], ["too hot"]


def attributes(file):
    file.attrs["thruster"], file.attrs["kind"] = ["T1", "T2"], b"bollard"
    file.attrs["created"], file.attrs["campaign"] = h5py.Empty("f8"), file["streams"].ref
    file["streams/cell/thrust"].attrs["calibration"] = "[" * 100_000


@pytest.mark.parametrize("change", [links, end, attributes, lambda file: None])
def test_it_says_what_load_says(tmp_path, change):
    path = odd(tmp_path / "r.h5", change)
    (found,), whole = headers([path]), load(path)
    assert isinstance(found, Header)
    assert (found.complete, found.outcome, found.cause) == (whole.complete, whole.outcome, whole.cause)
    assert found.texts["recording_id"] == whole.recording_id
    assert (found.texts["kind"] or "tunnel") == whole.kind
    assert {(s.name, c.name, c.unit) for s in found.streams for c in s.channels} == {
        (c.stream, c.name, c.unit) for c in whole.channels
    }
    assert found.duration == pytest.approx(whole.duration)
    if change is not attributes:
        assert found.texts["thruster"] == whole.thruster


@pytest.mark.parametrize("close", [True, False])
def test_of_a_recording_that_was_closed_or_not(tmp_path, close):
    path = written(tmp_path / "r.h5", close=close)
    (found,) = headers([path])
    assert (found.opened_as, found.complete) == (("plain", True) if close else ("swmr", False))
    assert found.duration == load(path).duration


def test_whoever_ends_the_child_is_named_and_the_others_are_read(tmp_path, monkeypatch):
    paths = [made(tmp_path / f"{k}.h5") for k in range(5)]
    whole = header_module._header
    monkeypatch.setattr(header_module, "_header", lambda path: os.abort() if path.name == "2.h5" else whole(path))
    found = headers([*paths, tmp_path / "none.h5"])
    assert [isinstance(each, Header) for each in found] == [True, True, False, True, True, False]
    assert "SIGABRT" in str(found[2])
    assert isinstance(found[5], RecordingError)


def test_a_bomb_and_what_is_no_recording_hinder_nothing(tmp_path):
    good, odd_one = made(tmp_path / "a.h5"), bomb(tmp_path / "b.h5", 2**20)
    (tmp_path / "c.h5").write_bytes(os.urandom(1000))
    found = headers([good, odd_one, tmp_path / "c.h5", tmp_path])
    assert [isinstance(each, Header) for each in found] == [True, True, False, False]
    assert headers([]) == []


def test_batches_in_order_each_in_a_child_of_its_own(tmp_path):
    paths = [made(tmp_path / f"{k}.h5") for k in range(5)]
    (tmp_path / "no.h5").write_bytes(b"none")
    found = list(headers_in_batches([paths[:2], [tmp_path / "no.h5"], paths[2:]]))
    assert [[isinstance(each, Header) for each in batch] for batch in found] == [[True] * 2, [False], [True] * 3]


def test_several_children_work_at_a_time_and_none_is_left_behind(tmp_path):
    """The first can only answer once the second is at work; the last is abandoned in the middle of its own."""
    ours, theirs = os.pipe()

    def waits():
        return os.read(ours, 1)

    def tells():
        os.write(theirs, b"!")
        return os.getpid()

    def stays():
        signal.pause()

    works = all_apart([(waits, []), (tells, []), (stays, [])], at_once=2)
    assert next(works) == b"!"
    assert next(works) != os.getpid()
    works.close()
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)
    os.close(ours)
    os.close(theirs)


def test_a_child_that_ends_without_an_answer_stands_in_its_place(tmp_path):
    found = list(all_apart([(os.getpid, []), (os.abort, [tmp_path]), (lambda: 3, [])], at_once=2))
    assert isinstance(found[1], RecordingError)
    assert "SIGABRT" in str(found[1])
    assert found[2] == 3
