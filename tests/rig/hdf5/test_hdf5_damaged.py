"""Files that a kill has torn or somebody has damaged: whole rows are read, the rest is said, nothing hangs."""

import os

import h5py
import numpy as np
import pytest

from rig.errors import RecordingError
from rig.hdf5 import RecordingFile, load, recover
from rig.hdf5.blocks import long_channels
from rig.hdf5.layout import PAGE_BYTES
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec
from tests.rig.hdf5.plain_files import plain

pytestmark = pytest.mark.timeout(60)
STREAMS = tuple(
    StreamSpec(name, "sim", (ChannelSpec("thrust", "thrust", "N"), ChannelSpec("raw", None, "1", integer=True)))
    for name in ("cell_a", "cell_b")
)
INDEX_BLOCK = 298
"""Bytes of the first piece of the list of chunks (EAIB) of every column, as this layout makes it."""


def written(path, flushes=8, close=False):
    """A recording as a kill leaves it, or a closed one; 300 rows a flush."""
    twin = path.with_suffix(".being-written")
    attributes = {"recording_id": "id", "thruster": "T1", "bench_toml": "b\n" * 900} | {f"a{i}": "x" for i in range(12)}
    file = RecordingFile(twin, attributes, STREAMS, 0)
    for first in range(0, 300 * flushes, 300):
        index = np.arange(first, first + 300)
        for stream in range(len(STREAMS)):
            file.add_rows(Rows(stream, index * 1_000_000, np.column_stack([index * 0.5, index]).astype(float)))
        file.add_event(EventRow(first, "info", f"event {first}"))
        file.add_step(StepRow(first, "hold", 1.0, first, first + 1))
        file.flush()
    if not close:
        path.write_bytes(twin.read_bytes())
    file.close("completed", "", 1.0)
    if close:
        path.write_bytes(twin.read_bytes())
    twin.unlink()
    return path


def places(data, signature):
    found, at = [], data.find(signature)
    while at >= 0:
        found.append(at)
        at = data.find(signature, at + 1)
    return found


def test_no_piece_that_a_kill_may_tear_crosses_a_page(tmp_path):
    """The kernel stops a write between two pages: a piece in two of them would be half old and half new."""
    data = written(tmp_path / "r.h5").read_bytes()
    blocks = places(data, b"EAIB")
    assert len(blocks) >= 6
    assert all(at // PAGE_BYTES == (at + INDEX_BLOCK - 1) // PAGE_BYTES for at in blocks)


def test_closing_writes_no_text_of_variable_length(tmp_path):
    """Its heap is written after what points there: a kill between the two left a file that could not be read."""
    with h5py.File(written(tmp_path / "r.h5", close=True)) as file:
        outcome = file.attrs.get_id("outcome").get_type()
        assert not outcome.is_variable_str()


@pytest.mark.parametrize("place", range(8))
def test_a_torn_index_costs_its_column_and_no_time(tmp_path, place):
    """In SWMR mode HDF5 tries a wrong checksum again for ever. Six columns, steps, events."""
    path = written(tmp_path / "r.h5")
    data = bytearray(path.read_bytes())
    data[places(data, b"EAIB")[place] + 100] ^= 0xFF
    path.write_bytes(data)
    recording = load(path)
    assert any("left out" in event.text for event in recording.events)
    kept = [channel.value.size for channel in recording.channels]
    assert kept == [2400] * len(kept)
    assert len(kept) >= 2
    recover(path, tmp_path / "copy.h5")
    copied = load(tmp_path / "copy.h5")
    assert [channel.value.size for channel in copied.channels] == kept
    assert any("can't be read" in event.text for event in copied.events)


def test_texts_that_are_torn_are_said_and_every_row_is_read(tmp_path):
    """Of recordings made before `outcome` had a fixed length."""
    path = written(tmp_path / "r.h5", close=True)
    with h5py.File(path, "r+") as file:
        del file.attrs["outcome"]
        file.attrs.create("outcome", "completed")
    data = bytearray(path.read_bytes())
    (at,) = [at for at in places(data, b"completed") if data[at - 8 : at] == (9).to_bytes(8, "little")]
    data[at - 16] ^= 0xFF  # number of the text within its heap, 16 bytes before it (File Format Specification, III.E)
    path.write_bytes(data)
    recording = load(path)
    assert [channel.value.size for channel in recording.channels] == [2400] * 4
    assert recording.outcome == "completed", "as /end says"
    assert any("attribute outcome of / can't be read" in event.text for event in recording.events)


def mutants(data, number):
    """Cut off, zeroed, flipped and exchanged pieces."""
    rng = np.random.default_rng(20)
    for _ in range(number):
        new = bytearray(data)
        at, n = int(rng.integers(len(data))), int(rng.integers(1, 5000))
        match int(rng.integers(4)):
            case 0:
                del new[at:]
            case 1:
                new[at : at + n] = bytes(len(new[at : at + n]))
            case 2:
                for place in rng.integers(len(data), size=8):
                    new[place] ^= 1 << int(rng.integers(8))
            case _:
                other = int(rng.integers(max(len(data) - n, 1)))
                new[at : at + n] = data[other : other + len(new[at : at + n])]
        yield bytes(new)


@pytest.mark.parametrize("close", [True, False])
def test_mutants_are_read_or_refused(tmp_path, close):
    data = written(tmp_path / "r.h5", close=close).read_bytes()
    path, copy, read = tmp_path / "mutant.h5", tmp_path / "copy.h5", 0
    for mutant in mutants(data, 100):
        path.write_bytes(mutant)
        copy.unlink(missing_ok=True)
        try:
            recording = load(path)
            read += 1
            recover(path, copy)
            load(copy)
        except RecordingError:
            continue
        assert recording.channels
    assert read >= 5


def test_a_size_that_the_file_can_not_justify_is_not_believed(tmp_path):
    path = written(tmp_path / "r.h5", close=True)
    with h5py.File(path, "r+") as file:
        file["streams/cell_a"].create_dataset("vast", (10**12,), dtype="<f8", chunks=(1024,))
        file["streams/cell_b/elsewhere"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/x")
        file["streams/cell_b"].create_dataset("outside", (8,), "<f8", external=[(str(path), 0, 64)])
    recording = load(path)
    assert {channel.name for channel in recording.channels} == {"thrust", "raw"}
    assert any("vast left out" in event.text for event in recording.events)


def test_what_is_no_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "fifo.h5")
    for path in (tmp_path / "fifo.h5", tmp_path, tmp_path / "none.h5"):
        with pytest.raises(RecordingError, match="is not there"):
            load(path)


def test_values_larger_than_anything_is_are_no_measurements(tmp_path):
    path = plain(tmp_path / "r.h5")
    with h5py.File(path, "r+") as file:
        file["streams/cell/thrust"][1] = 3e238
        file["streams/cell/time"][2] = 1e200
        file["streams/drive/command_voltage"][...] = np.array([0, 1, 2])
    (cell,) = load(path).all_of("thrust")
    assert np.isnan(cell.value[1])
    assert np.array_equal(cell.time, [0.0, 1.0])
    assert any("cell/thrust: 1 values beyond 1e+30 are damaged" in event.text for event in load(path).events)
    with long_channels(path, cell) as (found,):
        assert np.isnan(found.values(0, 2)[1])
