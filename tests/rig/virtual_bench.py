"""A second implementation of the bench's protocols, in memory and in virtual time: a motor, a load cell, a recorder.

The clock owns time: sleeping lets the world run on. Sockets are real, so that the links are the ones of the controller.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from rig.campaign.bench import Bench
from rig.campaign.config import BenchConfig, CampaignConfig, DeviceConfig, LimitConfig, MountConfig
from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import Plan, TareConfig
from rig.campaign.shapes import Levels
from rig.link.front_end_messages import Request, Snapshot
from rig.link.sockets import Peer, connect, pair
from rig.operate.virtual_time import assembled
from rig.recording.ledger import Fact
from rig.recording.recorder_link import RecorderLink
from rig.stages.session import Session
from tests.rig.virtual_devices import Cell, Input, Motor, RecorderPeer


@dataclass
class Clock:
    """Virtual time; the world moves in steps of 1 ms while somebody sleeps. `at`: s -> what happens then."""

    bench: VirtualBench
    t_ns: int = 10**9
    at: list[tuple[float, Callable[[], None]]] = field(default_factory=list)
    each: Callable[[float], None] = lambda now: None
    """Asked once a tick, when the loop goes to sleep."""

    def now_ns(self) -> int:
        return self.t_ns

    def sleep_until_ns(self, t_ns: int) -> None:
        self.each(self.t_ns * 1e-9)
        self.run_until(t_ns)
        self.bench.recorder.step(self.t_ns * 1e-9)

    def run_until(self, t_ns: int) -> None:
        while self.t_ns < t_ns:
            self.t_ns = min(self.t_ns + 1_000_000, t_ns)
            self.bench.step(self.t_ns * 1e-9)
        due = [what for when, what in self.at if when <= self.t_ns * 1e-9]
        self.at = [(when, what) for when, what in self.at if when > self.t_ns * 1e-9]
        for what in due:
            what()

    def stall(self, seconds: float) -> None:
        """The process is stopped for so long: the world goes on."""
        self.run_until(self.t_ns + round(seconds * 1e9))


@dataclass
class VirtualBench:
    """The world and everything of the controller on it."""

    folder: Path
    motor: Motor
    cell: Cell
    recorder: RecorderPeer
    inputs: tuple[Input, ...] = ()
    clock: Clock = field(init=False)
    session: Session = field(init=False)
    next_motor: float = 0.0
    next_cell: float = 0.0

    def step(self, now: float) -> None:
        if now >= self.next_motor:
            self.next_motor = now + 0.02
            self.motor.step(now, 0.02)
        self.motor.now = now
        if now >= self.next_cell:
            self.next_cell = now + self.cell.period
            self.cell.step(now)
        for each in self.inputs:
            each.step(now)

    def front(self) -> Peer:
        return connect(self.folder / "controller.sock", "the controller")

    @property
    def texts(self) -> str:
        return "\n".join(line.text for line in self.session.status.log)


PLAN = Plan(Levels((6.0, -6.0)), FixedDwell(0.6, 0.2), slew=24.0, rest=0.3, tare=TareConfig(0.4, 0.2, 2.0))


def bench_config(folder: Path, **changes) -> BenchConfig:
    limits = (LimitConfig("load_cell.thrust", -50.0, 50.0), LimitConfig("motor.current", max=30.0))
    devices = {name: DeviceConfig(name, "mt_sics", None) for name in ("load_cell", "motor")}
    facts = {
        "path": folder / "bench.toml",
        "text": "[bench]",
        "name": "virtual",
        "motor": "motor",
        "force": "load_cell",
    }
    facts |= {"force": "load_cell", "devices": devices, "can": {}, "limits": limits, "max_voltage": 24.0, "slew": 24.0}
    return BenchConfig(**(facts | changes))


def campaign_config(folder: Path, bench: BenchConfig, **changes) -> CampaignConfig:
    facts = {
        "path": folder / "campaign.toml",
        "text": "[campaign]",
        "name": "virtual",
        "bench": bench,
        "thrusters": ("T1",),
    }
    facts |= {
        "thrusters": ("T1",),
        "plan": PLAN,
        "output": folder,
        "unattended": True,
        "prove_watchdog": False,
        "tare": PLAN.tare,
    }
    if not changes.get("prove_watchdog", False):
        facts["overrides"] = {"campaign.prove_watchdog": "a test of something else"}
    return CampaignConfig(**(facts | changes))


@contextmanager
def virtual(
    folder: Path,
    before: tuple[Fact, ...] = (),
    mount=("true",),
    mount_timeout=1e6,
    loop_rate=50.0,
    inputs: tuple[Input, ...] = (),
    **campaign,
) -> Iterator[VirtualBench]:
    """A session that nobody has run yet. What it opened is closed at the end, if its campaign did not do that."""
    ours, theirs = pair("recorder")
    motor = Motor()
    world = VirtualBench(folder, motor, Cell(motor), RecorderPeer(Peer(theirs, "controller")), inputs)
    world.clock = Clock(world)
    config = bench_config(folder, mount=MountConfig(mount, mount_timeout), loop_rate=loop_rate)
    added = {each.name: DeviceConfig(each.name, "line_stream", None) for each in inputs}
    config = replace(config, devices={**config.devices, **added})
    bench = Bench(config, {}, {"load_cell": world.cell, "motor": motor, **{each.name: each for each in inputs}})
    asked = campaign_config(folder, config, **campaign)
    world.session = assembled(asked, folder, bench, RecorderLink(ours, None), world.clock, before)
    try:
        yield world
    finally:
        world.session.ledger.close()
        world.session.log.close()
        ours.close()
        world.recorder.peer.close()
        clients = world.session.loop.clients
        for client in clients.connected:
            client.peer.close()
        clients.listener.close()


def starter(world: VirtualBench, peer: Peer, seen: list[Snapshot]) -> Callable[[float], None]:
    """A front end that starts the campaign when its checks have passed, and reads everything."""
    asked = []

    def each(now: float) -> None:
        for message in peer.receive():
            seen.append(message)
        ready = world.session.status.state == "preflight" and not asked
        if ready and all(check.verdict in ("passed", "warning") for check in world.session.status.checks):
            asked.append(now)
            peer.send(Request("start"))
        if asked:
            peer.send(Request("lease"))

    return each
