"""A campaign played in snapshots: the second implementation of Feed. Deterministic; no sockets, no clock of its own."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace

from rig.errors import LinkError
from rig.link.front_end_messages import (
    Check,
    Device,
    LogLine,
    Point,
    Progress,
    Reading,
    Request,
    RequestKind,
    Snapshot,
    State,
    StreamHealth,
    TracedChannel,
    TraceRow,
    Watching,
)

C = {"T1": 0.402, "T3": 0.387}
"""N/V^2"""
LEVELS = (4.0, 8.0, 12.0, 16.0, 20.0, -4.0, -8.0, -12.0, -16.0, -20.0, 6.0, -6.0, 14.0, -14.0)
"""V"""
HOLD = 4.0
"""s per level, ramps included."""


class ManualClock:
    """Seconds that pass only when told to."""

    def __init__(self, now: float = 1000.0) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now


class PlayedFeed:
    """Hands out what `play` is given, keeps what is sent, and ends when told."""

    def __init__(self, *snapshots: Snapshot, stopwatch: Callable[[], float] = lambda: 0.0) -> None:
        self.sent: list[Request] = []
        self.sent_at_once: list[Request] = []
        """From the thread that reads the keys."""
        self.stop_times: list[float] = []
        """s by the stopwatch, one per stop sent."""
        self._stopwatch = stopwatch
        self.closed = False
        self._gone = False
        self._waiting = list(snapshots)
        self._news = asyncio.Event()

    def play(self, *snapshots: Snapshot) -> None:
        self._waiting.extend(snapshots)
        self._news.set()

    def end(self) -> None:
        """The controller is gone."""
        self._gone = True
        self._news.set()

    async def receive(self) -> Snapshot | None:
        while not self._waiting:
            if self._gone or self.closed:
                return None
            self._news.clear()
            await self._news.wait()
        return self._waiting.pop(0)

    def send(self, request: Request) -> None:
        if self._gone:
            raise LinkError(f"the controller is gone: the request `{request.kind}` reaches nobody")
        self.sent.append(request)
        if request.kind == "stop":
            self.stop_times.append(self._stopwatch())

    def send_from_thread(self, request: Request) -> None:
        self.sent_at_once.append(request)

    def close(self) -> None:
        self.closed = True
        self._news.set()

    def kinds(self) -> list[RequestKind]:
        """What was asked, apart from leases and that somebody looks on."""
        return [request.kind for request in self.sent if request.kind not in ("lease", "watch")]


def wobble(t: float) -> float:
    """Something like noise, the same every time, about -1..1."""
    return 0.6 * math.sin(37.7 * t) + 0.4 * math.sin(113.1 * t + 1.0)


def point(thruster: str, step: int, voltage: float, std_error: float = 0.35) -> Point:
    error = std_error * wobble(3.1 * step + 0.7)
    thrust = C[thruster] * voltage * abs(voltage) + error
    return Point(step, voltage, thrust, std_error, 4.0 - 0.1 * step, steady=step != 9, thruster=thruster)


def points(thruster: str, n: int) -> tuple[Point, ...]:
    return tuple(point(thruster, 2 * i + 1, V) for i, V in enumerate(LEVELS[:n]))


def command_at(t: float) -> float:
    """V: ramps of 0.8 s between the levels."""
    step, within = divmod(t, HOLD)
    levels = (0.0, *LEVELS)
    before, after = levels[int(step) % len(levels)], levels[(int(step) + 1) % len(levels)]
    return before + (after - before) * min(1.0, within / 0.8)


def trace(thruster: str, until: float) -> tuple[TraceRow, ...]:
    """10 rows/s from 0 to `until` s: command, then the channels of `readings`, each some noise wide."""
    rows = []
    for i in range(int(until * 10)):
        t = i / 10.0 + 0.05
        V = command_at(t)
        thrust = C[thruster] * V * abs(V) + 0.9 * wobble(t)
        values = [(V, V)]
        for reading in readings(V, thrust):
            value, wide = reading.value or 0.0, 0.3 if reading.unit == "N" else 0.02
            values.append((value - wide, value + wide))
        rows.append((t, *(edge for both in values for edge in both)))
    return tuple(rows)


def readings(V: float, thrust: float) -> tuple[Reading, ...]:
    cell, motor, supply, thermal = "load_cell", "motor", "motor_supply", "motor_thermal"
    return (
        Reading(f"{cell}.thrust", "thrust", "N", thrust, 0.01, -300.0, 300.0, 0.2),
        Reading(f"{cell}.stable", "", "1", 1.0, 0.01),
        Reading(f"{motor}.rotation_rate", "rotation_rate", "rev/s", 1.62 * V, 0.02, None, None, 0.2),
        Reading(f"{motor}.current", "current", "A", 0.055 * V * V + 0.31, 0.02, None, 40.0, 0.2),
        Reading(f"{motor}.duty", "", "1", V / 48.0, 0.02),
        Reading(f"{motor}.motor_voltage", "motor_voltage", "V", V * 0.995, 0.02),
        Reading(f"{supply}.bus_voltage", "bus_voltage", "V", 47.83, 0.18),
        Reading(f"{supply}.tachometer", "", "1", 48211.0, 0.18),
        Reading(f"{thermal}.motor_temperature", "", "degC", 31.4, 0.09, None, 80.0),
        Reading(f"{thermal}.fet_temperature", "", "degC", 38.2, 0.09),
        Reading(f"{thermal}.input_current", "", "A", 0.021 * V * V + 0.2, 0.09),
        Reading("flow.flow_speed", "flow_speed", "m/s", 0.012, 0.14, None, 0.05, 0.75),
        Reading("thermometer.water_temperature", "water_temperature", "degC", 16.8, 0.31),
        Reading("thermometer.pressure", "", "Pa", 101873.0, 0.31),
    )


CHANNELS = (
    TracedChannel("command", "command_voltage", "V"),
    *(TracedChannel(reading.channel, reading.quantity, reading.unit) for reading in readings(0.0, 0.0)),
)
CHECKS = (
    Check("load_cell", "passed", "Mettler WMS 404C, serial B512345678, 92 samples/s"),
    Check("motor", "passed", "VESC 6 MkVI, id 23, firmware 6.05, command timeout 0.5 s, then coasts"),
    Check("flow", "passed", "Nortek Vectrino, 4 samples/s"),
    Check("thermometer", "warning", "Keller 33X, last calibration 14 months ago: older than a year"),
    Check("disk", "passed", "212 GB free, 0.02 GB needed"),
    Check("plan", "passed", "31 steps, about 2:24 per thruster, at most 20.0 V of 24.0 V"),
    Check("watchdog", "passed", "0.5 s, then coast; fed by SET_* commands"),
)
DEVICES = (
    Device("load_cell", "mt_sics", "/dev/ttyUSB0", "Mettler WMS 404C, serial B512345678", "",
           (StreamHealth("load_cell", 92.0, 91.8, 0.01),), 4321, calibrated="2026-03-02", valid_until="2027-03-01",
           days_left=100, certificate="DKD 1234"),
    Device("motor", "vesc_can", "bus0 (/dev/ttyACM0)", "VESC 6 MkVI, id 23, firmware 6.05", "",
           (StreamHealth("motor", 50.0, 50.1, 0.02), StreamHealth("motor_supply", 50.0, 49.9, 0.02),
            StreamHealth("motor_thermal", 5.0, 5.0, 0.09)), 5210,
           watchdog="0.5 s, then coast; fed by SET_* commands", watchdog_measured=1.31),
    Device("flow", "nortek_nmea", "/dev/ttyUSB1", "Nortek Vectrino", "",
           (StreamHealth("flow", 4.0, 4.0, 0.14),), 190, 2, "$PNORC1,,,,*2"),
    Device("thermometer", "keller", "/dev/ttyUSB2", "Keller 33X, serial 4711", "",
           (StreamHealth("thermometer", 2.0, 2.0, 0.31),), 96, calibrated="2025-09-20", valid_until="2026-09-19",
           days_left=-63),
)  # fmt: skip
LOG = (
    LogLine(0.0, "info", "campaign `tunnel calibration` on bench `Desk-top tunnel`: T1, T3"),
    LogLine(2.4, "info", "watchdog proved: 0.52 s from the last command to 0 A, at rest after 1.31 s"),
    LogLine(5.9, "info", "tare: 0.31 ± 0.02 N over 3.0 s"),
    LogLine(14.2, "info", "hold +8.00 V: 25.83 ± 0.35 N, steady after 2.9 s"),
    LogLine(21.0, "warning", "thermometer: 1 sample missed, age 0.74 s"),
    LogLine(24.7, "warning", "hold -4.00 V: not steady after 6.0 s, drift 0.14 N/s above 0.10 N/s"),
    LogLine(31.3, "info", "note by demo: carriage crane moved at the far end"),
)


def snapshot(state: State = "preflight", **changes: object) -> Snapshot:
    """A plausible snapshot of one state."""
    plain = Snapshot(
        seq=1,
        campaign="tunnel calibration",
        state=state,
        thruster="T1",
        command=0.0,
        time=0.0,
        readings=readings(0.0, 0.31),
        checks=CHECKS,
        points=(),
        log=LOG[:1],
        log_count=1,
        trace=(),
        progress=None,
        files=(),
        attended=False,
        clients=1,
        devices=DEVICES,
        channels=CHANNELS,
    )
    return replace(plain, **changes)  # type: ignore[arg-type]  # names are checked by replace


def running(state: State = "hold", t: float = 47.0, **changes: object) -> Snapshot:
    """In the middle of T1's sweep, `t` s into its recording."""
    V = command_at(t)
    done = int(t / HOLD)
    facts: dict[str, object] = {
        "time": t,
        "command": V,
        "readings": readings(V, C["T1"] * V * abs(V) + 0.9 * wobble(t)),
        "points": points("T1", done),
        "log": LOG,
        "log_count": len(LOG),
        "trace": trace("T1", t),
        "progress": Progress(2 * done + 1, 31, t % HOLD, HOLD, 0, 2, t + 9.0, 241.0, 0.19),
        "files": ("recordings/2026-11-21_1502_T1.h5",),
        "outcome": "running",
        "watch": Watching("fits"),
    }
    return snapshot(state, **{**facts, **changes})


def campaign() -> tuple[Snapshot, ...]:
    """Preflight, two sweeps, the end: what a console that was there from the start is sent."""
    both = ("recordings/2026-11-21_1502_T1.h5", "recordings/2026-11-21_1506_T3.h5")
    end = Progress(30, 31, 4.0, 4.0, 1, 2, 288.0, 0.0, 1.0)
    return (
        snapshot("preflight"),
        running(t=20.0),
        running(t=56.5),
        running(t=56.0, thruster="T3", points=points("T3", 14), files=both),
        running(
            "done",
            t=60.0,
            thruster="T3",
            points=points("T3", 14),
            files=both,
            command=0.0,
            progress=end,
            readings=readings(0.0, 0.3),
            outcome="completed",
            stop_confirmed=True,
        ),
    )
