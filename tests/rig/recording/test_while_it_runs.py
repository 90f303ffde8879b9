"""What a recording is while a campaign writes it: its layout from the first row on, and what a power cut would leave.

Over real bytes in virtual time. The recorder writes in its flushes alone, and each ends with fsync: what is in the file
between two of them is what was synced.
"""

import shutil
import sys

import h5py
import numpy as np
import pytest

from rig.hdf5 import load, recover
from rig.hdf5.layout import FLUSH_PERIOD
from rig.hdf5.unclosed import open_unclosed
from rig.hdf5.write import RecordingFile
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec
from tests.rig.stages.byte_bench import recorded
from tests.rig.stages.lies.lying_bench import files

CUT = 1.0
"""s that a power cut may cost (promise 19)."""


def layout(file: h5py.File) -> dict[str, tuple]:
    """Of every group and dataset: what it is, how its values are stored, and what its attributes are."""
    found = {"/": ("group", None, attributes(file))}

    def note(name, item):
        stored = (item.dtype.str if item.dtype.kind != "V" else str(item.dtype), item.maxshape, item.chunks)
        found[name] = ("dataset", stored, attributes(item))

    def visit(name, item):
        if isinstance(item, h5py.Dataset):
            note(name, item)
        else:
            found[name] = ("group", None, attributes(item))

    file.visititems(visit)
    return found


def attributes(item) -> tuple:
    return tuple(sorted((name, str(item.attrs.get_id(name).dtype)) for name in item.attrs))


class Copies:
    """Copies of a growing recording, each half a second, with the time of each."""

    def __init__(self, recording, folder) -> None:
        self._recording, self._folder = recording, folder
        self.taken = []

    def __call__(self, bench) -> None:
        if self._recording.exists() and bench.now() >= 0.53 * len(self.taken):
            copy = self._folder / f"cut-{len(self.taken)}.h5"
            shutil.copy(self._recording, copy)
            self.taken.append((bench.now(), copy))


@pytest.fixture(scope="module")
def cut(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cut")
    copies = Copies(folder / "run" / "T2.h5", folder)
    whole, t0_ns = recorded(files(folder, 1.5), folder / "run", copies)
    began = (t0_ns - 10**12) * 1e-9
    return whole, [(now - began, path) for now, path in copies.taken], folder / "run" / "T2.h5"


def test_no_group_dataset_or_attribute_is_made_after_the_first_row(cut):
    _, copies, closed = cut
    with h5py.File(closed) as file:
        last = layout(file)
    assert len(last) > 15
    for _, path in copies:
        with open_unclosed(path, OSError("not closed")) as file:
            assert layout(file) == last
    kinds = [stored[0] for what, stored, _ in last.values() if what == "dataset"]
    assert not [kind for kind in kinds if "O" in kind], "text in tables has a fixed length"


MAKES = {"create_group", "create_dataset", "require_group", "require_dataset", "make_new_dset", "create", "modify"}
"""Functions of h5py that make a group, a dataset or an attribute; HDF5 itself lets them pass in SWMR mode."""


def test_nothing_of_h5py_that_makes_something_is_called_after_the_first_row(tmp_path):
    made = []

    def spy(frame, event, _argument):
        code = frame.f_code
        if event == "call" and "h5py" in code.co_filename and code.co_name in MAKES:
            made.append(code.co_qualname)

    stream = StreamSpec(
        "cell", "sim", (ChannelSpec("thrust", "thrust", "N"), ChannelSpec("raw", None, "1", integer=True))
    )
    sys.setprofile(spy)
    try:
        file = RecordingFile(tmp_path / "r.h5", {"thruster": "T1"}, (stream,), 0)
        at_first, made[:] = set(made), []
        for second in range(20):
            stamps = np.arange(1000) * 1_000_000 + second * 10**9
            file.add_rows(Rows(0, stamps, np.ones((1000, 2))))
            file.add_rows(Rows(0, stamps[:1], np.ones((1, 2))))  # older than the last: dropped, and closing says so
            file.add_step(StepRow(second, "hold", 1.0, second, second + 1))
            file.add_event(EventRow(second, "info", "long " * 200))
            file.flush()
        file.close("completed", "nothing " * 40, 20.0)
    finally:
        sys.setprofile(None)
    assert {"Group.create_group", "Group.create_dataset", "AttributeManager.create"} <= at_first
    assert made == []


def test_a_power_cut_leaves_what_was_synced(cut, report, tmp_path):
    whole, copies, _ = cut
    thrust = whole.first_of("thrust")
    tried = [(now, path) for now, path in copies if now > 2 * FLUSH_PERIOD]
    assert len(tried) > 30
    for now, path in tried:
        found = load(path)
        assert not found.complete
        value = found.first_of("thrust")
        rows = value.time.size
        assert (value.time == thrust.time[:rows]).all(), "no row is wrong, none is there twice"
        assert (value.value == thrust.value[:rows]).all()
        due = thrust.time[thrust.time <= now]
        lost = float(due[-1] - value.time[-1]) if due.size > rows else 0.0
        report("thrust lost at a power cut", lost, "s")
        assert lost <= CUT
    copy = tmp_path / "recovered.h5"
    recover(tried[-1][1], copy)
    assert load(copy).first_of("thrust").time.size == load(tried[-1][1]).first_of("thrust").time.size
