"""Time and memory of `rig diagnose` as a process, on ten minutes at 100 Hz with the whole catalogue.

    python benchmarks/diagnosis/diagnose_speed.py [SEEDS]           three kinds of recording, SEEDS of each (default 3)
    python benchmarks/diagnosis/diagnose_speed.py --profile         what the time goes into: functions and imports

Recordings of `sim_devices.concealed`, every explaining channel recorded: nothing concealed, one effect, two effects at
plain strength. Each is diagnosed by a process of its own, start included, on one core and with one BLAS thread. The
least of two runs counts: the rest is what else the machine does. Memory is the peak of the process.
"""

from __future__ import annotations

import cProfile
import os
import pstats
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

import h5py
import numpy as np

from sim_devices import concealed

GOAL = 5.0
"""s, of ten minutes at 100 Hz with the whole catalogue."""
KINDS: dict[str, tuple[tuple[str, ...], ...]] = {
    "clean": ((),),
    "one effect": (("dead_band",), ("motor_lag",), ("heating",), ("winding_resistance",), ("load_cell_creep",)),
    "two effects": (("dead_band", "heating"), ("asymmetry", "motor_lag"), ("exponent", "recirculation")),
}
CHANNELS = ("rotation_rate", "current", "bus_voltage", "motor_temperature", "flow_speed")
STRENGTH = 40.0
RUNS = 2
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def write_case(path: Path, effects: tuple[str, ...], seed: int) -> None:
    """A recording file by plain h5py, after the description of the format."""
    case = concealed.case(
        np.random.default_rng(seed),
        effects,
        STRENGTH,
        noise="mixed",
        plan="interleaved",
        sampling=100.0,
        duration=600.0,
        channels=CHANNELS,
    )
    (rows,) = concealed.rows(case)
    with h5py.File(path, "w") as file:
        file.attrs.update(
            format="thruster-rig-recording",
            format_version=1,
            recording_id=rows.recording_id,
            thruster=rows.thruster,
            complete=True,
            outcome="completed",
        )
        for column in rows.columns:
            group = file.require_group(f"streams/{column.stream}")
            if "time" not in group:
                group["time"] = column.time
            group[column.name] = column.value
            group[column.name].attrs.update(quantity=column.quantity, unit=column.unit)


def as_process(path: Path) -> tuple[float, float, float]:
    """(s by the clock, s of CPU, MB at the peak) of one diagnosis as a process."""
    core = str(min(os.sched_getaffinity(0)))
    before = perf_counter()
    process = subprocess.Popen(
        ["taskset", "-c", core, str(Path(sys.executable).with_name("rig")), "diagnose", str(path), "--json", "-"],
        env={**os.environ, **ONE_THREAD},
        stdout=subprocess.DEVNULL,
    )
    _, status, usage = os.wait4(process.pid, 0)
    took = perf_counter() - before
    if status:
        raise SystemExit(f"rig diagnose {path} ended with {os.waitstatus_to_exitcode(status)}")
    return took, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def best(path: Path) -> tuple[float, float, float]:
    found = [as_process(path) for _ in range(RUNS)]
    return min(f[0] for f in found), min(f[1] for f in found), max(f[2] for f in found)


def table(folder: Path, seeds: int) -> None:
    print("| recording | runs | clock, median s | clock, longest s | CPU, median s | peak MB | within 5 s |")
    print("|---|---|---|---|---|---|---|")
    for kind, sets in KINDS.items():
        found = []
        for seed in range(max(seeds, len(sets))):
            path = folder / f"{kind.replace(' ', '_')}_{seed}.h5"
            write_case(path, sets[seed % len(sets)], seed)
            found.append(best(path))
        took, cpu, memory = np.array(found).T
        print(
            f"| {kind} | {len(found)} | {np.median(took):.1f} | {took.max():.1f} | {np.median(cpu):.1f} "
            f"| {memory.max():.0f} | {np.count_nonzero(took < GOAL)} |",
            flush=True,
        )


def profile(folder: Path) -> None:
    """Functions by their own time and with what they call, of one recording with two effects; then the imports."""
    from rig.diagnose.command import diagnose_files

    path = folder / "profiled.h5"
    write_case(path, KINDS["two effects"][0], 0)
    run = cProfile.Profile()
    run.runcall(diagnose_files, [path])
    for order in ("tottime", "cumulative"):
        pstats.Stats(run).strip_dirs().sort_stats(order).print_stats(25)
    imports = subprocess.run(
        [
            sys.executable,
            "-X",
            "importtime",
            "-c",
            "import rig.cli, rig.diagnose.command, identification.mismatch.pipeline",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    lines = [line for line in imports.stderr.splitlines() if line.count("|") == 2 and "cumulative" not in line]
    print("\n".join(sorted(lines, key=lambda line: int(line.split("|")[1]))[-30:]))


def main() -> None:
    os.environ.update(ONE_THREAD)
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[1:] == ["--profile"]:
            profile(Path(folder))
        else:
            table(Path(folder), int(sys.argv[1]) if len(sys.argv) > 1 else 3)


if __name__ == "__main__":
    main()
