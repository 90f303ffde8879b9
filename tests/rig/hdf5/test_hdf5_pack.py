"""`rig pack`: the copy holds what the raw file does, is smaller, and a torn chunk of it is not believed."""

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from rig.errors import RecordingError
from rig.hdf5 import load
from rig.hdf5.archive import pack as packing
from rig.hdf5.archive.pack import pack
from rig.recording.pack import pack_command
from tests.rig.fleet.small_recordings import write


@pytest.fixture
def raw(tmp_path):
    return write(tmp_path / "raw.h5", 3)


def rig_pack(*arguments):
    return CliRunner().invoke(pack_command, [str(each) for each in arguments], catch_exceptions=False)


def test_load_reads_the_same_of_both(raw, tmp_path):
    before = raw.read_bytes()
    done = pack(raw, tmp_path / "packed.h5")
    assert raw.read_bytes() == before
    assert done.after == done.path.stat().st_size < done.before
    one, other = load(raw), load(done.path)
    assert (one.recording_id, one.thruster, one.steps, one.events) == (
        other.recording_id,
        other.thruster,
        other.steps,
        other.events,
    )
    for a, b in zip(one.channels, other.channels, strict=True):
        assert (a.quantity, a.unit, a.stream, a.calibration) == (b.quantity, b.unit, b.stream, b.calibration)
        assert np.array_equal(a.time, b.time)
        assert np.array_equal(a.value, b.value, equal_nan=True)


def test_all_of_a_file_is_copied_also_what_no_reader_of_ours_knows(raw, tmp_path):
    with h5py.File(raw, "r+") as file:
        file.attrs["odd"] = np.arange(3)
        file["streams"].create_group("camera/lens").create_dataset("frame", data=np.eye(300))
        file["streams/camera"].attrs["note"] = "side"
    out = pack(raw, tmp_path / "packed.h5").path
    with h5py.File(out) as file:
        assert file.attrs["odd"].tolist() == [0, 1, 2]
        assert np.array_equal(file["streams/camera/lens/frame"][()], np.eye(300))
        assert file["streams/camera"].attrs["note"] == "side"
        column = file["streams/cell/thrust"]
        assert (column.compression, column.shuffle, column.fletcher32) == ("gzip", True, True)
        assert file.attrs["packed_from"].decode() == "raw.h5"
        assert len(file.attrs["packed_sha256"]) == 64


def test_a_copy_that_differs_is_not_kept(raw, tmp_path, monkeypatch):
    def worse(source, target, copy=packing._copy):
        copy(source, target)
        if source.name == "/":
            target["streams/cell/thrust"][7] += 1e-12

    monkeypatch.setattr(packing, "_copy", worse)
    with pytest.raises(RecordingError, match="packed copy differs at /streams/cell/thrust"):
        pack(raw, tmp_path / "packed.h5")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["raw.h5"]


def test_a_torn_chunk_is_no_number(raw, tmp_path):
    out = pack(raw, tmp_path / "packed.h5").path
    with h5py.File(out) as file:
        chunk = file["streams/cell/thrust"].id.get_chunk_info(0)
    data = bytearray(out.read_bytes())
    data[chunk.byte_offset + chunk.size // 2] ^= 0xFF
    out.write_bytes(data)
    found = load(out)
    assert found.first_of("thrust") is None or not np.isfinite(found.first_of("thrust").value).any()
    assert any("thrust" in event.text for event in found.events)


def test_what_is_not_closed_is_recovered_first(raw, tmp_path):
    with h5py.File(raw, "r+", libver=("v110", "v110")) as file:
        file.swmr_mode = True
        file.flush()
        torn = tmp_path / "torn.h5"
        torn.write_bytes(raw.read_bytes())
    told = rig_pack(raw, torn)
    assert told.exit_code == 1
    assert f"{torn} was not closed in order; save it first: rig recover" in told.output
    assert (tmp_path / "packed" / "raw.h5").exists()
    assert "1 of 2 recordings packed" in told.output
    again = rig_pack(raw)
    assert (again.exit_code, "a recording is never overwritten" in again.output) == (1, True)
