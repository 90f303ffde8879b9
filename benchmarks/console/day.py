"""What a controller tells a console in hours of a campaign: snapshots, made as fast as they are wanted."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import sin

from rig.link.front_end_messages import (
    Device,
    LogLine,
    Point,
    Progress,
    Reading,
    Snapshot,
    StreamHealth,
    TracedChannel,
    TraceRow,
)

CHANNELS = (("thrust", "N"), ("raw", "1"), ("rotation_rate", "rev/s"), ("current", "A"), ("bus_voltage", "V"),
            ("motor_voltage", "V"), ("flow_speed", "m/s"), ("torque", "N.m"))  # fmt: skip
"""Eight, each at 1 kHz: a console sees the newest value and the rate of each."""
HOLD = 10.0
"""s of a hold, its ramp included."""
RUN = 3600.0
"""s of a thruster's run: 360 holds."""
TRACE = 0.1
"""s between rows of the trace."""
TRACED = (TracedChannel("command", "command_voltage", "V"),
          *(TracedChannel(f"daq.{name}", name if name != "raw" else "", unit) for name, unit in CHANNELS))  # fmt: skip
LOG_LINES = 500


@dataclass
class Day:
    """A campaign of one-hour runs. `at` moves on, and tells what came meanwhile."""

    time: float = 0.0
    """s since it began."""
    sequence: int = 0
    log: list[LogLine] = field(default_factory=list)
    log_count: int = 0
    rows: list[TraceRow] = field(default_factory=list)
    """Of the trace, since the last snapshot."""
    points: list[Point] = field(default_factory=list)
    files: list[str] = field(default_factory=list)

    def forward(self, seconds: float) -> bool:
        """True when a new run begins: its trace is another."""
        before, self.time = self.time, self.time + seconds
        new_run = not self.files or int(before / RUN) != int(self.time / RUN)
        if new_run:
            self.files.append(f"recordings/long-day/T{len(self.files) + 1}.h5")
            self.points.clear()
        for hold in range(int(before / HOLD) + 1, int(self.time / HOLD) + 1):
            self._held(hold)
        first, last = int(before / TRACE) + 1, int(self.time / TRACE)
        self.rows = [traced(k * TRACE) for k in range(first, last + 1)]
        fallen = next((k for k, (a, b) in enumerate(pairwise(self.rows), 1) if b[0] < a[0]), 0)
        self.rows = self.rows[fallen:]
        return new_run

    def _held(self, hold: int) -> None:
        V = volts(hold * HOLD - 0.5)
        self.points.append(
            Point(
                2 * len(self.points) + 1, V, 0.4 * V * abs(V) + 0.2 * sin(hold), 0.05, 8.0, hold % 9 != 0, self.thruster
            )
        )
        level = "warning" if hold % 9 == 0 else "info"
        text = f"hold {V:+.2f} V: {self.points[-1].thrust:.2f} N, {'not ' if hold % 9 == 0 else ''}steady after 8.0 s"
        self.log.append(LogLine(self.time, level, text, len(self.files) - 1))  # type: ignore[arg-type]
        self.log_count += 1
        del self.log[:-LOG_LINES]

    @property
    def thruster(self) -> str:
        return f"T{len(self.files)}"

    def snapshot(self) -> Snapshot:
        """Without its trace, which `rig.link.clients` puts in."""
        self.sequence += 1
        time, V, N = self.time % RUN, volts(self.time), thrust(self.time)
        readings = tuple(
            Reading(f"daq.{name}", name if name != "raw" else "", unit, N + k + 0.01 * sin(self.sequence), 0.001)
            for k, (name, unit) in enumerate(CHANNELS)
        )
        streams = tuple(StreamHealth(f"daq_{name}", 1000.0, 999.0 + sin(self.sequence), 0.001) for name, _ in CHANNELS)
        device = Device("daq", "line", "/dev/ttyUSB0", "eight channels at 1 kHz", "", streams, int(8000 * self.time))
        return Snapshot(
            seq=self.sequence, campaign="a long day", state="hold", thruster=self.thruster, command=V, time=time,
            readings=readings, checks=(), points=tuple(self.points), log=tuple(self.log), log_count=self.log_count,
            trace=(), progress=Progress(int(time / HOLD), int(RUN / HOLD), time % HOLD, HOLD, len(self.files) - 1, 4,
                                        self.time, max(4 * RUN - self.time, 0.0), min(self.time / (4 * RUN), 1.0)),
            files=tuple(self.files), outcome="running", attended=False, since_begin=self.time, devices=(device,),
            channels=TRACED,
        )  # fmt: skip


def volts(t: float) -> float:
    """The command: levels in no order, a ramp of a second between two."""
    hold, within = divmod(t, HOLD)
    before, after = level(hold - 1), level(hold)
    return before + (after - before) * min(within, 1.0)


def traced(t: float) -> TraceRow:
    """Command, then the channels: least and greatest of each."""
    V, N = volts(t), thrust(t)
    return (t % RUN, V, V, *(edge for k in range(len(CHANNELS)) for edge in (N + k - 0.3, N + k + 0.3)))


def level(hold: float) -> float:
    return round(10.0 * sin(2.4 * hold), 2)


def thrust(t: float) -> float:
    V = volts(t)
    return 0.4 * V * abs(V) + 0.2 * sin(37.7 * t)
