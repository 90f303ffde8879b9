"""Promise 28: a long run over real bytes, in virtual time: memory does not grow, and no sample is lost.

`make reliability` plays 24 h, an hour of a processor and more; THRUSTER_RIG_SOAK (hours) says otherwise.
"""

import gc
import os
import re
from pathlib import Path

import numpy as np
import pytest

from tests.reliability.page.measured import times
from tests.rig.stages.byte_bench import recorded
from tests.rig.stages.lies.lying_bench import files

HOURS = float(os.environ.get("THRUSTER_RIG_SOAK", times(1, 240) * 0.1))
RATE = 92.0
"""samples/s of the load cell."""
WARM = 0.25
"""Share of the run after which memory is looked at: caches and the tables of the file are there by then."""
GROWTH = 0.05
"""Relative, of what the process takes (promise 28)."""

pytestmark = pytest.mark.timeout(round(600 + 600 * HOURS))


def resident() -> float:
    """MiB that this process takes."""
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


class Looks:
    """Memory each minute of the bench; what the simulated drive remembers of its commands is not the rig's."""

    def __init__(self) -> None:
        self.memory = []

    def __call__(self, bench) -> None:
        bench.commands.clear()
        if bench.now() >= 60.0 * len(self.memory):
            self.memory.append((bench.now(), resident()))


def test_a_long_run_takes_no_more_memory_and_loses_no_sample(tmp_path, report):
    dwell = 30.0
    levels = max(round(HOURS * 3600 / dwell), 4)
    campaign = files(tmp_path, dwell)
    text = campaign.read_text(encoding="utf-8")
    voltages = ", ".join(("8.0", "-8.0", "12.0", "-12.0")[i % 4] for i in range(levels))
    campaign.write_text(re.sub(r"voltages = \[.*\]", f"voltages = [{voltages}]", text), encoding="utf-8")
    looks = Looks()
    found, _ = recorded(campaign, tmp_path / "run", looks)
    assert (found.outcome, found.cause) == ("completed", "")
    assert [step.phase for step in found.steps].count("hold") == levels
    thrust = found.first_of("thrust")
    gaps = np.diff(thrust.time)
    lost = int(np.sum(np.rint(gaps * RATE) - 1.0))
    report("hours played", float(thrust.time[-1]) / 3600, "h")
    report("samples lost", lost, "samples")
    report("samples of the load cell", thrust.time.size, "samples")
    assert lost == 0
    assert not [
        event.text for event in found.events if "dropped" in event.text or "could not be understood" in event.text
    ]
    end = looks.memory[-1][0]
    settled = next(size for t, size in looks.memory if t >= WARM * end)
    growth = max(size for _, size in looks.memory) / settled - 1.0
    report("memory after a quarter", settled, "MiB")
    report("growth of memory", 100 * growth, "%")
    assert growth < GROWTH
