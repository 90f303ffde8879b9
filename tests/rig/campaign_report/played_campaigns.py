"""Campaigns of two thrusters over real bytes in virtual time: ledger, recordings and events are those of a bench."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

from rig.campaign.bench import build
from rig.campaign.loading import load_campaign
from rig.link.sockets import Peer, pair
from rig.operate.virtual_time import RecordingClock, assembled
from rig.recording.recorder import Recorder
from rig.recording.recorder_link import RecorderLink
from rig.stages.campaign import run
from rig.stages.recording_header import Stamp
from sim_devices.bench.settings import load as load_world
from sim_devices.bench.virtual import VirtualBench
from sim_devices.bench.virtual_wire import Host

ROOT = Path(__file__).parents[3]
NOTES = 'new seal <b>& bearing</b> "P7"'
CAMPAIGN = """
[campaign]
name = "tunnel"
bench = "bench.toml"
output = "."
thrusters = ["T1", "T3"]
operator = "<script>alert('A. Nyman')</script>"
notes = '{notes}'
expected_C = 0.4
unattended = true
prove_watchdog = false
[overrides]
"campaign.prove_watchdog" = "measured elsewhere"
[watch]
off = true
[tare]
duration = 1.0
max_drift = 1.0
[plan]
kind = "levels"
voltages = [8.0, -8.0, 12.0, -12.0, 16.0, -16.0]
zero_every = 2
slew = 24.0
[plan.dwell]
kind = "fixed"
duration = 1.0
"""
MOUNT = '[mount]\ncommand = ["cp", "/dev/null", "{bench_dir}/{thruster}.mounted"]\n'


@dataclass
class World:
    """The simulated bench; sleeping lets it run on, puts the thruster on it that was asked for, and breaks its cell."""

    bench: VirtualBench
    folder: Path
    broken: str = ""
    """Thruster at whose 12 V the load cell falls silent; empty: none."""

    @property
    def wires(self):
        return self.bench.wires

    def now_ns(self) -> int:
        return self.bench.now_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        self.bench.sleep_until_ns(t_ns)
        for asked in self.folder.glob("*.mounted"):
            asked.unlink()
            self.bench.world.mount(asked.stem)
        volts = self.bench.commands[-1][1] if self.bench.commands else 0.0
        if self.broken == self.bench.world.mounted and abs(volts - 12.0) < 0.01:
            self.broken = ""
            self.bench.fault("load_cell", "silent")


def files(folder: Path, limit: float = 300.0) -> Path:
    """The demo's bench without its thermometer, and a campaign of two thrusters."""
    text = (ROOT / "benches" / "simulated" / "bench.toml").read_text(encoding="utf-8")
    text = text[: text.index("[devices.thermometer]")] + text[text.index('[limits."load_cell') : text.index("[mount]")]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "bench.toml").write_text(text.replace("300.0", f"{limit}") + MOUNT, encoding="utf-8")
    (folder / "campaign.toml").write_text(CAMPAIGN.format(notes=NOTES), encoding="utf-8")
    return folder / "campaign.toml"


def played(
    folder: Path, name: str = "tunnel-20260112-101500", broken: str = "", seed: int = 1, day: str = "12"
) -> Path:
    """The campaign's folder, of a run that came to its end or was ended by a silent load cell."""
    config = load_campaign(files(folder))
    settings = load_world(ROOT / "benches" / "simulated" / "world.toml")
    thrusters = {each: replace(made, rotor="instant") for each, made in settings.world.thrusters.items()}
    made = replace(settings, world=replace(settings.world, thrusters=thrusters), seed=seed, step=0.005)
    bench = VirtualBench(made, Host(adapter=3e-4, work=5e-4, reader_late=2e-4, loop_late=3e-4), "bus0")
    world = World(bench, folder, broken)
    where = folder / name
    where.mkdir()
    ours, theirs = pair("recorder")
    clock = RecordingClock(world, recorder := Recorder(Peer(theirs, "controller"), world.now_ns))
    session = assembled(config, where, build(config.bench, world.wires), RecorderLink(ours, None), clock)
    numbers = count(1)
    session.stamp = lambda: Stamp(f"{name}-{next(numbers)}", f"2026-01-{day}T10:1{seed}:00+00:00")
    clock.session = session
    try:
        run(session)
    finally:
        recorder.turn()
        theirs.close()
    return where
