"""Devices and a recorder in memory and in virtual time: what the virtual bench is made of."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.errors import LinkError
from drivers.protocols import Channel, LinkHealth, Sample, Stream, Watchdog
from rig.link.framing import Message
from rig.link.recorder_messages import Ack, Close, Closed, EventRow, Failed, Open, Ready, Rows, StepRow
from rig.link.sockets import Peer

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


def winding(degrees: float) -> Input:
    """A thermometer in the motor."""
    return Input("winding", "motor_temperature", "degC", degrees)


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
