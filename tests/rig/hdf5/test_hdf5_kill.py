"""A writer that does nothing but append and flush, killed at random instants: most kills hit HDF5 at work."""

import subprocess
import sys

import numpy as np
import pytest

from rig.hdf5 import load

WRITER = """
import sys
import numpy as np
from pathlib import Path
from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec

streams = [StreamSpec(f"s{i}", "x", tuple(ChannelSpec(f"c{j}", "thrust", "N") for j in range(4))) for i in range(3)]
file = RecordingFile(Path(sys.argv[1]), {"recording_id": "id", "thruster": "T"}, streams, 0)
n = 0
while True:
    index = np.arange(n, n + 50)
    for i in range(3):
        file.add_rows(Rows(i, index, np.repeat(index[:, None], 4, axis=1).astype(float)))
    file.add_step(StepRow(n, "hold", 1.0, n, n + 50))
    file.add_event(EventRow(n, "info", f"event {n}"))
    file.flush()
    n += 50
    print(n, flush=True)
"""
KILLS = 24


def kill_after(path, flushes):
    """Let it flush so many times and a little longer; returns rows that were flushed for certain."""
    with subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE) as process:
        for _ in range(flushes):
            process.stdout.readline()
        process.kill()
        return 50 * flushes + 50 * len(process.stdout.read().splitlines())


@pytest.mark.reliability
def test_every_flushed_row_is_there_after_a_kill(tmp_path):
    rng = np.random.default_rng(7)
    for trial in range(KILLS):
        path = tmp_path / f"{trial}.h5"
        flushed = kill_after(path, int(rng.integers(1, 60)))
        recording = load(path)
        assert recording.attributes["opened_as"] == "swmr"
        assert len(recording.channels) == 12
        for channel in recording.channels:
            assert channel.value.size >= flushed
            assert np.array_equal(channel.value, np.arange(channel.value.size))
        assert len(recording.steps) >= flushed // 50
        assert [step.index for step in recording.steps] == list(range(0, 50 * len(recording.steps), 50))
        assert len(recording.events) >= flushed // 50
