"""A recording that grows for a day costs the recorder no more memory than one of a minute."""

import subprocess
import sys

CHANNELS, ROWS = 40, 200_000
MOST = 12.0
"""MiB, of 62 that are written."""
PROGRAM = f"""
import sys, gc
from pathlib import Path
import numpy as np
from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, Rows, StreamSpec

def resident():
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20

stream = StreamSpec("cell", "mt_sics", tuple(ChannelSpec(f"c{{i}}", None, "1") for i in range({CHANNELS})))
file = RecordingFile(Path(sys.argv[1]), {{"recording_id": "id", "thruster": "T1"}}, (stream,), t0_ns=0)
values = np.ones((500, {CHANNELS}))
for at in range(0, {ROWS}, 500):
    file.add_rows(Rows(0, np.arange(at, at + 500), values))
    file.flush()
    if at == 5_000:
        begun = resident()
print(resident() - begun)
"""


def test_what_was_written_is_not_kept_in_memory(tmp_path):
    found = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "r.h5")], capture_output=True, text=True, check=True
    )
    assert float(found.stdout) < MOST
