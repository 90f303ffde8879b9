"""What the catalogue costs: N small recordings, rebuilt, brought up to date, listed and filtered, each by `rig list`.

    python benchmarks/catalogue.py 10000 [FOLDER]

Prints for each command s by the clock, s of processors (children included) and the load of the machine. The
recordings have eight channels in four streams, both configuration texts, 20 steps and 5 events, 160 kB each; they are
copies of one that `rig.hdf5` wrote, with ids, times and thrusters of their own. FOLDER is kept, and filled up when it
is there.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import uuid
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from rig.catalogue.index import NAME
from rig.hdf5 import RecordingFile
from rig.link.recorder_messages import ChannelSpec, EventRow, Rows, StepRow, StreamSpec

ROOT = Path(__file__).parents[1]
CALL = "from rig.cli import entry; entry()"
PER_FOLDER = 8
"""Recordings of a campaign."""
STREAMS = {
    "load_cell": (("thrust", "N"), ("raw", "1")),
    "motor": (("motor_voltage", "V"), ("current", "A"), ("rotation_rate", "rev/s"), ("bus_voltage", "V")),
    "flow": (("flow_speed", "m/s"),),
    "command": (("command_voltage", "V"),),
}
ID, CREATED, THRUSTER = f"{uuid.UUID(int=0)}", "2020-01-01T00:00:00+00:00", "thruster-0000"


def template(path: Path) -> bytes:
    """One recording, with an id, a time and a thruster that are found again in its bytes."""
    streams = [StreamSpec(name, name, tuple(_channel(*facts) for facts in of)) for name, of in STREAMS.items()]
    texts = {
        "bench_toml": (ROOT / "benches" / "simulated" / "bench.toml").read_text(encoding="utf-8"),
        "campaign_toml": (ROOT / "campaigns" / "demo.toml").read_text(encoding="utf-8"),
    }
    named = {"recording_id": ID, "created": CREATED, "thruster": THRUSTER, "kind": "tunnel", "campaign": "synthetic"}
    file = RecordingFile(path, named | texts, streams, 0)
    times = np.arange(50, dtype=np.int64) * 20_000_000
    for k, stream in enumerate(streams):
        file.add_rows(Rows(k, times, np.zeros((times.size, len(stream.channels)))))
    for k in range(20):
        file.add_step(StepRow(k, "hold", float(k), k * 0.05, k * 0.05 + 0.05))
    for k in range(5):
        file.add_event(EventRow(k * 0.1, "info", "synthetic"))
    file.close("completed", "", 1.0)
    return path.read_bytes()


def _channel(name: str, unit: str) -> ChannelSpec:
    calibration = json.dumps({"gain_std": 0.001}) if name == "thrust" else ""
    return ChannelSpec(name, name if name != "raw" else None, unit, calibration=calibration)


def write(folder: Path, first: int, count: int) -> None:
    """Recordings `first` to `first + count`, PER_FOLDER in a folder, a quarter of an hour apart."""
    with tempfile.TemporaryDirectory() as made:
        data = template(Path(made) / "template.h5")
    for k in range(first, first + count):
        place = folder / f"campaign-{k // PER_FOLDER:05}"
        place.mkdir(parents=True, exist_ok=True)
        created = datetime.fromisoformat(CREATED) + timedelta(minutes=15 * k)
        own = data.replace(ID.encode(), f"{uuid.uuid5(uuid.NAMESPACE_OID, str(k))}".encode())
        own = own.replace(CREATED.encode(), created.astimezone(UTC).isoformat().encode())
        own = own.replace(THRUSTER.encode(), f"thruster-{k % 100:04}".encode())
        (place / f"run-{k}.h5").write_bytes(own)


def timed(what: str, *arguments: str) -> None:
    """One command in a process of its own."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", CALL, *arguments], capture_output=True, text=True, check=True, cwd=ROOT
    )
    after, spent = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - begun
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    lines = len(done.stdout.splitlines())
    print(f"| {what} | {spent:.2f} | {busy:.2f} | {lines} | {os.getloadavg()[0]:.1f} |", flush=True)


def main(count: int, folder: Path) -> None:
    there = len(list(folder.rglob("*.h5")))
    write(folder, there, max(count - there, 0))
    (folder / NAME).unlink(missing_ok=True)
    print(f"{count} recordings in {folder}\n\n| | s | s of processors | lines | load |\n|---|---|---|---|---|")
    place = str(folder)
    timed("start: `rig --help`", "--help")
    timed("rebuild", "list", place, "--limit", "20", "--rebuild")
    timed("list, nothing changed, newest 20", "list", place, "--limit", "20")
    timed("list, nothing changed, all", "list", place)
    timed("filter: thruster", "list", place, "--thruster", "thruster-0042")
    timed("filter: a month", "list", place, "--since", "2020-02-01", "--until", "2020-02-29")
    timed("calibrations", "list", place, "--what", "calibrations")
    for path in sorted(folder.rglob("*.h5"))[:10]:
        path.touch()
    timed("list, 10 files changed", "list", place, "--limit", "20")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000, Path((sys.argv[2:] or [scratch])[0]).resolve())
