"""A drawn case run on its bench in virtual time, by whoever records it; then what was really commanded is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from uuid import UUID

import numpy as np

from sim_devices.bench.settings import BenchSettings, CanBus
from sim_devices.bench.virtual import VirtualBench
from sim_devices.concealed.cases.definition import Case, Run, settings
from sim_devices.concealed.cases.plans import Profile
from sim_devices.recorded.benches import BUS, CELL
from sim_devices.recorded.campaign import bench_file, campaign_file
from sim_devices.recorded.draw import FINEST, Drawn
from sim_devices.world.noise import Noise
from sim_devices.world.settings import Cell

Record = Callable[[Path, Path, VirtualBench, tuple[str, str]], tuple[Path, int]]
"""`record(campaign file, new folder, bench, (id, date))` -> the recording and ns of its t = 0 on the bench's clock.
Raises RuntimeError with a sentence for a run that did not come to its end."""

THRUSTER = "T"
DATE = "2026-01-01T00:00:00+00:00"


def run(drawn: Drawn, folder: Path, record: Record) -> tuple[Path, Case]:
    """The recording, and the case as it was: with the voltages that the drive took up, when it did.

    Raises RuntimeError.
    """
    folder.mkdir(parents=True)
    (folder / "bench.toml").write_text(bench_file(drawn.bench, drawn.case.scale), encoding="utf-8")
    text = campaign_file(drawn.campaign, THRUSTER, drawn.case.scale)
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    bench = virtual_bench(drawn)
    (planned,) = drawn.case.runs
    stamp = (str(UUID(bytes=np.random.default_rng([planned.seed, 1]).bytes(16), version=4)), DATE)
    path, t0_ns = record(folder / "campaign.toml", folder / "run", bench, stamp)
    start = (t0_ns - bench.stamp(0.0)) * 1e-9
    return path, replace(drawn.case, runs=(_as_run(planned, bench, start),))


def virtual_bench(drawn: Drawn) -> VirtualBench:
    """The bench with the case's world behind it."""
    case, on, (run,) = drawn.case, drawn.bench, drawn.case.runs
    world = settings(case)
    made = BenchSettings(
        world=replace(world, thrusters={THRUSTER: case.thruster}, mounted=THRUSTER, cell=Cell(zero_offset=run.tare),
                      noise=noises(drawn)),
        devices=on.devices, can=CanBus(), links=Path(), truth=None, seed=run.seed, step=FINEST, faults=(),
    )  # fmt: skip
    return VirtualBench(made, on.host, BUS, {CELL: on.cell.filter_time})


def noises(drawn: Drawn) -> dict[str, Noise]:
    """Of each conversion: so loud that a reading, which may be the mean of several, has the noise of the case.

    It is the converter's: behind a low pass of the amplifier.
    """
    law = drawn.case.noise
    found = {sensor.quantity: Noise(white=sensor.law.white) for sensor in drawn.case.sensors}
    white = law.white * drawn.bench.cell.average**0.5
    slow = law.slow[0] if law.slow else None
    found["thrust"] = Noise(white, slow.std, slow.time_constant) if slow else Noise(white)
    return found | {"flow_speed": Noise(white=0.004)}


def _as_run(planned: Run, bench: VirtualBench, start: float) -> Run:
    """From `start` (s of the bench) on: the voltages that the drive took up, on the recording's clock."""
    rows = [(0.0, next((v for t, v in reversed(bench.commands) if t <= start), 0.0))]
    rows += [(t - start, v) for t, v in bench.commands if t > start]
    time, volts = np.array(rows, dtype=np.float64).T
    profile = Profile(planned.profile.kind, time, volts, (), bench.now() - start)
    return replace(planned, profile=profile, start=start)
