"""Time and memory of a diagnosis where it is used, each as a process of its own, start included.

    python benchmarks/diagnosis/times.py [NAME ...]             every recording, or those NAMEs
    python benchmarks/diagnosis/times.py --tree OTHER_CHECKOUT  each also by another checkout, one after the other
    python benchmarks/diagnosis/times.py --timeout S            s of CPU after which one is given up (default 900)

The recordings are made by this checkout, whichever diagnoses them: half a minute of the demo's bench with the motor's
lag (every byte recorded by the rig in virtual time); one effect and two at plain strength over ten minutes at 100 Hz
with every channel, as in diagnose_speed.py; five effects of field size over 530 s at 80 Hz; the same thruster a second
time against the twin of that run; `rig compare` of five effects against the same five of other sizes; one effect over
ten minutes at 1 kHz. One BLAS thread. CPU time is what counts on a machine that does other things; memory is the peak.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import copyfile
from time import perf_counter

import h5py
import numpy as np
from diagnose_speed import ONE_THREAD, write_case

from rig.cli import record_in_virtual_time
from sim_devices import concealed
from sim_devices.concealed.cases.definition import Concealed
from sim_devices.concealed.cases.plans import profile
from sim_devices.concealed.cases.shapes import shape
from sim_devices.recorded.on_disc import conceal

HERE = Path(__file__).resolve().parents[2]
FIELD = {"asymmetry": 0.15, "dead_band": 0.04, "inflow_dynamics": 0.22, "motor_lag": 0.12, "winding_resistance": 0.13}
"""Five effects in the middle of what thrusters in the field have, in the world's own units."""
SIMULATED = {"asymmetry": 0.1, "dead_band": 0.03, "inflow_dynamics": 0.3, "motor_lag": 0.1, "winding_resistance": 0.1}
"""What a simulation has of the same."""
DURATION, SAMPLING = 530.0, 80.0
RIG = "from rig.cli import entry; entry()"


@dataclass(frozen=True)
class Used:
    """What a process took."""

    cpu: float
    """s."""
    wall: float
    """s."""
    peak: float
    """MB."""
    status: int


def rig(tree: Path, words: Sequence[object], timeout: int) -> Used:
    """One command of a checkout's rig; a status that is not 0 is told, not raised."""

    before = perf_counter()
    process = subprocess.Popen(
        ["sh", "-c", f'ulimit -t {timeout}; exec "$@"', "sh", sys.executable, "-c", RIG, *map(str, words)],
        env={**os.environ, **ONE_THREAD, "PYTHONPATH": str(tree)},
        cwd=tree,
        stdout=subprocess.DEVNULL,
    )
    _, status, usage = os.wait4(process.pid, 0)
    cpu = usage.ru_utime + usage.ru_stime
    return Used(cpu, perf_counter() - before, usage.ru_maxrss / 1024, os.waitstatus_to_exitcode(status))


def field_case(sizes: dict[str, float], plan: str, seed: int, *, quiet: float = 1.0) -> concealed.Case:
    """The one thruster with effects of these sizes, `plan` its command; `quiet`: of the noise."""
    channels = ("rotation_rate", "current", "bus_voltage", "motor_temperature")
    bare = concealed.case(
        np.random.default_rng(seed),
        (),
        plan=plan,
        noise="white",
        duration=DURATION,
        sampling=SAMPLING,
        channels=channels,
    )
    rng = np.random.default_rng(1)
    effects = tuple(Concealed(shape(effect, bare.scale, rng, ""), size) for effect, size in sizes.items())
    return replace(bare, effects=effects, noise=replace(bare.noise, white=quiet * bare.noise.white))


def again(case: concealed.Case, seed: int) -> concealed.Case:
    """The same thruster with its effects, another command and other noise."""
    (run,) = case.runs
    laid = profile("random", case.scale.voltage, DURATION, case.dt, np.random.default_rng(seed), smooth=False)
    return replace(case, runs=(replace(run, profile=laid, seed=run.seed + 1),))


def write(case: concealed.Case, path: Path) -> None:
    (rows,) = concealed.rows(case)
    with h5py.File(path, "w") as file:
        file.attrs.update(format="thruster-rig-recording", format_version=1, recording_id=path.stem)
        file.attrs.update(thruster="T", complete=True, outcome="completed")
        for column in rows.columns:
            group = file.require_group(f"streams/{column.stream}")
            if "time" not in group:
                group["time"] = column.time
            group[column.name] = column.value
            group[column.name].attrs.update(quantity=column.quantity, unit=column.unit)


def demo(folder: Path) -> None:
    """Half a minute on the bench of `make demo`, by the rig's own loop, drivers and file; the motor lags."""
    asked = {"token": "demo", "seed": [7], "bench": "tunnel", "effects": ["motor_lag"], "plan": "interleaved"}
    conceal({**asked, "strength": 60.0, "duration": 30.0}, folder / "concealed", record_in_virtual_time)
    copyfile(folder / "concealed" / "open" / "demo" / "0.h5", folder / "demo.h5")


def recorded(folder: Path) -> None:
    """All that is diagnosed."""
    demo(folder)
    write_case(folder / "one.h5", ("dead_band",), 0)
    write_case(folder / "two.h5", ("dead_band", "heating"), 0)
    five = field_case(FIELD, "random", 3)
    write(five, folder / "five.h5")
    write(again(five, 4), folder / "again.h5")
    write(field_case(SIMULATED, "random", 3, quiet=0.01), folder / "simulated.h5")
    rng = np.random.default_rng(5)
    fast = concealed.case(
        rng, ("motor_lag",), noise="white", plan="staircase", sampling=1000.0, duration=600.0, channels=()
    )
    write(fast, folder / "fast.h5")


def words(folder: Path, tree: int) -> dict[str, list[object]]:
    """What is typed, in the order in which one needs the other's result; the twin is the tree's own."""
    quiet, twin = ["--json", folder / "answer.json"], folder / f"twin-{tree}.json"
    return {
        "demo": ["diagnose", folder / "demo.h5", *quiet],
        "one": ["diagnose", folder / "one.h5", *quiet],
        "two": ["diagnose", folder / "two.h5", *quiet],
        "five": ["diagnose", folder / "five.h5", "--save-twin", twin, *quiet],
        "twin": ["diagnose", folder / "again.h5", "--twin", twin, *quiet],
        "compare": ["compare", folder / "simulated.h5", folder / "five.h5", *quiet],
        "fast": ["diagnose", folder / "fast.h5", *quiet],
    }


def answer(path: Path) -> str:
    """The verdict and what is named, for who compares two checkouts."""
    if not path.exists():
        return "nothing"
    found = json.loads(path.read_text(encoding="utf-8"))
    return f"{found['verdict']}: {', '.join(f['effect'] for f in found['findings']) or 'nothing named'}"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--tree", type=Path)
    parser.add_argument("--timeout", type=int, default=900)
    asked = parser.parse_args()
    names = {*asked.names, *(["five"] if "twin" in asked.names else [])}  # whose twin it is
    trees = [*([asked.tree.resolve()] if asked.tree else []), HERE]
    print("| recording | checkout | CPU s | wall s | peak MB | answer |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recorded(folder)
        commands = [words(folder, i) for i in range(len(trees))]
        for which in commands[0]:
            if names and which not in names:
                continue
            for tree, command in zip(trees, commands, strict=True):
                (folder / "answer.json").unlink(missing_ok=True)
                used = rig(tree, command[which], asked.timeout)
                said = f"status {used.status}" if used.status else answer(folder / "answer.json")
                print(f"| {which} | {tree} | {used.cpu:.1f} | {used.wall:.1f} | {used.peak:.0f} | {said} |", flush=True)


if __name__ == "__main__":
    main()
