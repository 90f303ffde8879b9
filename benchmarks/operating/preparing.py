"""What is in the folder before the operator comes: the files of `rig init`, made the bench's own, and its world."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.operating.at_keys import Operator, Transcript
from benchmarks.operating.place import Place
from benchmarks.operating.tmux import Tmux
from rig.link.live_runs import live_runs
from tests.reliability.live import whole

STOP_WITHIN = 0.25
"""s from a key that tmux is told to press to command 0: the 0.1 s of the promise, and the start of tmux's process."""
MORE = """
[limits."motor.rotation_rate"]
max_age = 0.6              # s
max = 100.0                # rev/s

[calibration.load_cell]
date = 2026-03-01
valid_until = 2099-12-31
certificate = "A-2026-117"
"""
CAMPAIGN = {
    'operator = ""': 'operator = "M. Keys"',
    "levels = 4 ": 'sides = "forward"\nlevels = 4 ',
    "slew = 12.0 ": "slew = 24.0 ",
}
EFFECT = """
[effects.winding_resistance]
resistance = 0.012             # ohm
"""
"""So faint that one short sweep does not tell it from others."""
PLAN = """
[tare]
duration = 1.0             # s
max_std_error = 0.2        # N
max_drift = 1.0            # N/s
"""


def replaced(path: Path, changes: dict[str, str], more: str = "") -> None:
    """A file with each text of `changes` in another's place, and `more` at its end."""
    text = path.read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text, (path, old)
        text = text.replace(old, new)
    path.write_text(text + more, encoding="utf-8")


def prepare(folder: Path, effect: str, dwell: float) -> None:
    """The files of `rig init` with a dated calibration, an effect, holds of `dwell` s, samples that may be late on a
    busy machine."""
    bench = folder / "bench.toml"
    bench.write_text(whole(bench.read_text(encoding="utf-8")), encoding="utf-8")
    replaced(bench, {}, MORE)
    replaced(folder / "campaign.toml", CAMPAIGN | {"duration = 2.0 ": f"duration = {dwell} "}, PLAN)
    replaced(folder / "world.toml", {}, effect)


@contextmanager
def bench_of(folder: Path, transcript: Transcript) -> Iterator[Place]:
    """The simulated bench of the folder, in a process of its own, until the context ends."""
    process = subprocess.Popen(
        [sys.executable, "-m", "sim_devices", "world.toml"], stdout=subprocess.PIPE, text=True, cwd=folder
    )
    assert process.stdout is not None
    try:
        for line in process.stdout:
            if line.strip() == "ready":
                break
        yield Place(folder, transcript)
    finally:
        for run in live_runs():
            if Path(run.folder).is_relative_to(folder):  # of a day that has failed: its console is gone with tmux
                os.kill(run.pid, signal.SIGTERM)
        process.terminate()
        process.wait(10.0)
        process.stdout.close()


def begin(operator: Operator, folder: Path, effect: str, dwell: float) -> None:
    """`rig init`, and what makes it this bench."""
    operator.runs(
        f"rig init {folder}", "three files, and what to type next", "bench.toml, world.toml, campaign.toml", "rig run"
    )
    prepare(folder, effect, dwell)
    operator.types(f"clear; cd {folder}", "in the folder", r"\$\s*\Z")


@contextmanager
def at_work(folder: Path, transcript: Transcript, dwell: float) -> Iterator[tuple[Tmux, Operator, Place]]:
    """A tmux of its own, an operator in the folder of a new bench, and that bench."""
    with Tmux() as tmux:
        operator = Operator(tmux.window("desk", folder), transcript)
        begin(operator, folder / "bench", EFFECT, dwell)
        with bench_of(folder / "bench", transcript) as place:
            yield tmux, operator, place
