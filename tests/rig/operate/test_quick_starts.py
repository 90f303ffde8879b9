"""What an operator waits for, and what 40 live tests start each time: processes come up without what they don't use."""

import subprocess
import sys

import pytest

HEAVY = ("scipy.stats", "scipy.signal", "scipy.ndimage", "matplotlib")


@pytest.mark.parametrize(
    ("modules", "unused"),
    [
        ("rig.stages.controller", (*HEAVY, "h5py", "textual")),
        ("rig.recording.recorder", (*HEAVY, "textual", "can")),
        ("rig.watch.watcher", (*HEAVY, "textual", "can")),
        ("rig.console", HEAVY),
        ("rig.operate.run, rig.operate.summary", HEAVY),
        ("sim_devices.__main__, sim_devices.bench.bench", ("scipy", "h5py", "can", *HEAVY)),
    ],
)
def test_a_process_comes_up_without(modules, unused):
    code = f"import sys, {modules}; print([name for name in {unused} if name in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"
