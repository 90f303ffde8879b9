"""A second implementation of the bench's protocols, in memory and in virtual time: a motor, a load cell, a recorder.

The clock owns time: sleeping lets the world run on. Sockets are real, so that the links are the ones of the controller.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivers.errors import LinkError
from drivers.protocols import Channel, LinkHealth, Sample, Stream, Watchdog
from rig.campaign.bench import Bench
from rig.campaign.config import BenchConfig, CampaignConfig, DeviceConfig, LimitConfig, MountConfig
from rig.campaign.plan import FixedDwell, Plan, TareConfig
from rig.campaign.shapes import Levels
from rig.link.clients import Clients
from rig.link.front_end_messages import Request, Snapshot
from rig.link.recorder_messages import Ack, Close, Closed, EventRow, Failed, Open, Ready, Rows, StepRow
from rig.link.sockets import Message, Peer, connect, listen, pair
from rig.recording.ledger import Fact, Ledger
from rig.recording.line_writer import LineWriter
from rig.recording.recorder_link import RecorderLink
from rig.stages.session import Session, begin

LAG = 0.05
"""s, of the propeller."""
DEVICE_TIMEOUT = 0.5
"""s without a command, then the motor lets go."""


@dataclass
class Motor:
    """1 rev/s and 2 A per volt. Obeys the next command after its timeout, as a VESC does."""

    name: str = "motor"
    timeout: float | None = DEVICE_TIMEOUT
    resumes: bool = False
    """As a Roboteq: any command after a lapse, and the old set-point is driven again."""
    ignores: bool = False
    """Takes every command and does nothing with it; also not the second way."""
    refuses: bool = False
    """Its wire takes nothing."""
    released: int = 0
    volts: float = 0.0
    rotation: float = 0.0
    extra_current: float = 0.0
    silent: bool = False
    sent: list[tuple[float, float]] = field(default_factory=list)
    """(s, V) of every command."""
    now: float = 0.0
    fed: float = 0.0
    rows: list[Sample] = field(default_factory=list)
    closed: bool = False

    @property
    def streams(self) -> tuple[Stream, ...]:
        channels = (Channel("rotation_rate", "rotation_rate", "rev/s"), Channel("current", "current", "A"))
        return (Stream(self.name, "virtual", channels, 0.02),)

    @property
    def watchdog(self) -> Watchdog:
        return Watchdog(self.timeout, "commands", "coast", resumes_by_itself=self.resumes)

    @property
    def max_voltage(self) -> float:
        return 24.0

    def open(self) -> str:
        return "virtual motor 1"

    def drain(self) -> list[Sample]:
        rows, self.rows = self.rows, []
        return rows

    def health(self) -> LinkHealth:
        return LinkHealth(not self.refuses, 1, 0, (), "its wire takes nothing" if self.refuses else None)

    def command(self, volts: float) -> None:
        if self.refuses:
            raise LinkError("motor: its wire takes nothing")
        self.sent.append((self.now, volts))
        self.fed = self.now
        if not self.ignores:
            self.volts = volts

    def release(self) -> None:
        self.released += 1
        if not self.ignores:
            self.volts = 0.0

    def close(self) -> None:
        self.closed = True

    def step(self, now: float, dt: float) -> None:
        self.now = now
        driven = self.volts
        if self.timeout is not None and now - self.fed > self.timeout and not self.ignores:
            driven = 0.0
            self.volts = self.volts if self.resumes else 0.0
        self.rotation += (driven - self.rotation) * min(dt / LAG, 1.0)
        if not self.silent:
            current = 2 * abs(driven) + self.extra_current
            self.rows.append(Sample(self.name, round(now * 1e9), (self.rotation, current)))


@dataclass
class Cell:
    """0.4 N/V^2 with an offset and noise. `spoil` may change each value; None: the row does not come."""

    motor: Motor
    name: str = "load_cell"
    period: float = 0.01
    spoil: Callable[[float], float | None] = lambda value: value
    bad: int = 0
    dropped: int = 0
    received: int = 0
    error: str | None = None
    noise: random.Random = field(default_factory=lambda: random.Random(2))
    rows: list[Sample] = field(default_factory=list)
    refuses: str = ""

    @property
    def streams(self) -> tuple[Stream, ...]:
        return (Stream(self.name, "virtual", (Channel("thrust", "thrust", "N"),), self.period),)

    def open(self) -> str:
        if self.refuses:
            raise LinkError(self.refuses)
        return "virtual cell 2"

    def drain(self) -> list[Sample]:
        rows, self.rows = self.rows, []
        return rows

    def health(self) -> LinkHealth:
        first = ("half a line",) if self.bad else ()
        return LinkHealth(self.error is None, self.received, self.bad, first, self.error, self.dropped)

    def close(self) -> None: ...

    def step(self, now: float) -> None:
        rotation = self.motor.rotation
        value = self.spoil(0.4 * rotation * abs(rotation) + 0.7 + self.noise.gauss(0, 0.02))
        self.received += 1
        if value is not None:
            self.rows.append(Sample(self.name, round(now * 1e9), (value,)))


@dataclass
class Input:
    """An instrument of one channel, twenty rows a second."""

    name: str
    quantity: str
    unit: str
    value: float | None = 0.0
    """None: its cable is pulled."""
    rows: list[Sample] = field(default_factory=list)
    due: float = 0.0

    @property
    def streams(self) -> tuple[Stream, ...]:
        return (Stream(self.name, "virtual", (Channel(self.quantity, self.quantity, self.unit),), 0.05),)

    def open(self) -> str:
        return "virtual input 3"

    def drain(self) -> list[Sample]:
        rows, self.rows = self.rows, []
        return rows

    def health(self) -> LinkHealth:
        return LinkHealth(True, 1, 0, ())

    def close(self) -> None: ...

    def step(self, now: float) -> None:
        if now >= self.due and self.value is not None:
            self.due = now + 0.05
            self.rows.append(Sample(self.name, round(now * 1e9), (self.value,)))


def stop_input() -> Input:
    """A mushroom button: 1 is pressed."""
    return Input("button", "emergency_stop", "1")


def flow_meter(speed: float) -> Input:
    """Reads `speed` m/s."""
    return Input("flow", "flow_speed", "m/s", speed)


@dataclass
class RecorderPeer:
    """The other end of the recorder's link: keeps what comes, and answers as the recorder process does."""

    peer: Peer
    taken: list[Message] = field(default_factory=list)
    refuses: str = ""
    deaf: bool = False
    """Reads and answers nothing."""
    mute_close: bool = False
    free_bytes: int = 2**40
    acked: float = 0.0
    open: bool = False

    def step(self, now: float) -> None:
        if self.deaf:
            return
        for message in self.peer.receive():
            self.taken.append(message)
            match message:
                case Open(path=path):
                    self.open = not self.refuses
                    self.peer.send(Failed(self.refuses) if self.refuses else Ready(path))
                case Close() if not self.mute_close:
                    self.open = False
                    self.peer.send(Closed("file", "0" * 64))
        if self.open and now - self.acked >= 0.25:
            self.acked = now
            self.peer.send(Ack((), now, self.free_bytes))

    def of(self, kind: type) -> list:
        return [message for message in self.taken if isinstance(message, kind)]

    @property
    def events(self) -> list[EventRow]:
        return self.of(EventRow)

    @property
    def steps(self) -> list[StepRow]:
        return self.of(StepRow)

    @property
    def rows(self) -> list[Rows]:
        return self.of(Rows)


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
    log = LineWriter((folder / "controller.log").open("ab"), sync=False)
    clients = Clients(listen(folder / "controller.sock"))
    parts = (bench, RecorderLink(ours, None), Ledger.open(folder), log, clients, world.clock)
    world.session = begin(campaign_config(folder, config, **campaign), folder, (), parts, before)
    try:
        yield world
    finally:
        world.session.ledger.close()
        log.close()
        ours.close()
        world.recorder.peer.close()
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
