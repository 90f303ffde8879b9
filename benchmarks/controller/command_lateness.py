"""From the row of a command in the recording to the simulated drive that obeys it: how much that varies.

    python benchmarks/controller/command_lateness.py [--busy 4]

One thruster of campaigns/demo.toml on the bench of benches/simulated, through ptys, once on an idle machine and once
beside `--busy` processes that only count. The drive's own time is in the truth log. Both processes have real-time
scheduling where that is permitted; the kernel hands the bytes of a pty over by a worker thread that has not, and that
is what a busy machine adds. A real adapter's driver sends in the rig's own thread.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from full_buses import busy

from identification.recording import Floats
from rig.cli import main as rig
from rig.hdf5 import load
from sim_devices.bench.process import running

ROOT = Path(__file__).resolve().parents[2]
BENCH = ROOT / "benches" / "simulated"
CHANGES = {
    "../benches/simulated/bench.toml": "bench.toml",
    '"T1", "T3"': '"T1"',
    "../recordings": "out",
    "max_drift = 0.2": "max_drift = 2.0",
    "max_std_error = 0.05": "max_std_error = 0.5",
}
"""In the campaign: its place, one thruster, and tares that a busy machine may have."""
NEAR = 0.009
"""s between a row and the command of the truth log that is it; ticks are 0.02 s apart."""


def recorded(folder: Path, many: int) -> tuple[Floats, Floats]:
    """Times of the commands, s of two clocks: as recorded, and as the drive took them."""
    for name in ("world.toml", "bench.toml"):
        (folder / name).write_text((BENCH / name).read_text(encoding="utf-8"), encoding="utf-8")
    text = (ROOT / "campaigns" / "demo.toml").read_text(encoding="utf-8")
    for old, new in CHANGES.items():
        assert old in text, old
        text = text.replace(old, new)
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    with running(folder / "world.toml", folder / "ports") as bench, busy(many):
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as said:
            status = rig(["run", str(folder / "campaign.toml"), "--headless", "--no-report"])
        if status:
            raise SystemExit(f"the campaign did not complete: {said.getvalue()[-500:]}")
        taken = [line for line in bench.truth("command") if line["volts"] is not None]
    (path,) = folder.glob("out/*/*.h5")
    (command,) = load(path).all_of("command_voltage")
    driven = np.array([line["t_ns"] * 1e-9 for line in taken])
    first = command.time[np.abs(command.value) > 1.0][0]
    began = next(line["t_ns"] * 1e-9 for line in taken if abs(line["volts"]) > 1.0)
    return command.time[command.time >= first], driven[driven >= began - NEAR] - (began - first)


def lateness(rows: Floats, drive: Floats) -> Floats:
    """ms by which each command is later at the drive than the median one."""
    for _ in range(3):
        after = np.clip(np.searchsorted(drive, rows), 1, drive.size - 1)
        nearest = np.where(drive[after] - rows < rows - drive[after - 1], after, after - 1)
        apart = drive[nearest] - rows
        same = np.abs(apart) < NEAR
        drive = drive - np.median(apart[same])
    late: Floats = 1e3 * (apart[same] - np.median(apart[same]))
    return late


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--busy", type=int, default=4)
    for many in (0, parser.parse_args().busy):
        with tempfile.TemporaryDirectory() as name:
            late = lateness(*recorded(Path(name), many))
        p5, p95, p99 = np.quantile(late, [0.05, 0.95, 0.99])
        print(
            f"{many} busy: {late.size} commands, later than their median by ms: p5 {p5:+.2f}, p95 {p95:+.2f}, "
            f"p99 {p99:+.2f}, worst {late.max():+.2f}; load {os.getloadavg()[0]:.1f}"
        )


if __name__ == "__main__":
    main()
