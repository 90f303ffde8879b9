"""A calibration on the demo's bench, over real bytes in virtual time, with somebody who hangs the weights."""

from __future__ import annotations

import datetime
import shutil
from dataclasses import dataclass, field, replace
from pathlib import Path

from rig.calibrate.command import Asked, calibrate_bench
from rig.calibrate.loads_file import load_plan
from rig.link.sockets import Peer, pair
from rig.recording.recorder import Recorder
from rig.recording.recorder_link import RecorderLink
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host
from sim_devices.world.settings import Cell

ROOT = Path(__file__).parents[3]
LOADS = """
[calibration]
certificate = "DKD 7"
thermometer = "thermometer.water_temperature"
[place]
gravity = 9.8055
gravity_std = 3e-5
lever_std = 5e-5
[weights.pieces]
1kg = { mass = 1.0, expanded = 16e-6 }
2kg = { mass = 2.0, tolerance = 30e-6 }
5kg = { mass = 5.0, std = 40e-6 }
10kg = { mass = 10.0, std = 80e-6 }
[steps]
ladder = [[], ["2kg"], ["5kg"], ["10kg"], ["10kg", "5kg", "2kg"]]
directions = [1, -1]
repetitions = 1
preloads = 0
settle = 1.0
steady = 0.1
hold = 2.0
"""


@dataclass
class Hanger:
    """Hangs what is asked for; `mistakes`: step (from 1) -> N that it hangs the first time instead."""

    bench: VirtualBench
    mistakes: dict[str, float] = field(default_factory=dict)
    doubts: str = "again"
    asked: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    answers: list[str] = field(default_factory=list)

    def begin(self, session):
        pass

    def hang(self, prompt, load, force, turn):
        self.asked.append(prompt)
        if self.answers and (answer := self.answers.pop(0)) != "go":
            return answer
        step = prompt.split()[1]
        self.bench.world.state.hung = self.mistakes.pop(step, force)
        turn()
        return "go"

    def doubt(self, text, turn):
        self.said.append(f"DOUBT {text}")
        turn()
        return self.doubts

    def tell(self, text):
        self.said.append(text)


class RecordingClock:
    def __init__(self, bench: VirtualBench, recorder: Recorder) -> None:
        self.bench, self.recorder = bench, recorder

    def now_ns(self) -> int:
        return self.bench.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self.recorder.turn()
        self.bench.sleep_until_ns(t_ns)


def bench_of(cell: Cell | None = None, effects=None, seed=1, mounted="T1") -> VirtualBench:
    settings = load_world(ROOT / "benches" / "simulated" / "world.toml")
    world = replace(settings.world, cell=cell or settings.world.cell, effects=effects or {}, mounted=mounted)
    made = replace(settings, world=world, seed=seed, step=0.005)
    return VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "bus0")


def files(folder: Path, loads: str = LOADS) -> tuple[Path, Path]:
    """Bench file and loads file in `folder`."""
    bench, plan = folder / "bench.toml", folder / "loads.toml"
    if not bench.exists():
        shutil.copy(ROOT / "benches" / "simulated" / "bench.toml", bench)
    plan.write_text(loads)
    return bench, plan


def weighed(folder: Path, virtual: VirtualBench, hanger: Hanger | None = None, loads: str = LOADS, **changes):
    """Exit status and the one who hung."""
    bench, plan = files(folder, loads)
    hanger = hanger or Hanger(virtual)
    ours, theirs = pair("recorder")
    recorder = Recorder(Peer(theirs, "controller"), virtual.now_ns)
    link = RecorderLink(ours, None)
    asked = Asked(bench, load_plan(plan), hanger, wires=virtual.wires, day=datetime.date(2026, 11, 26), **changes)
    try:
        return calibrate_bench(asked, link, RecordingClock(virtual, recorder)), hanger
    finally:
        link.shut_down()
        recorder.turn()
        theirs.close()
