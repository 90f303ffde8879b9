"""The stages before a propeller may turn: open the devices, judge the bench until the operator starts it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from rig.campaign.disarmed import disarmed
from rig.control.event_log import Level
from rig.control.readings import Readings
from rig.errors import DeviceError, LinkError
from rig.link.front_end_messages import Check
from rig.recording.ledger import file_facts
from rig.stages.preflight import all_checks, armed_checks, consistency_check, device_checks, flow_check
from rig.stages.session import Session, Stopped

SETTLE_ROWS = 5
"""Rows of the slowest stream that are waited for before the preflight judges rates."""
FLOW_WINDOW = 3.0
"""s of measured flow that the preflight takes the mean of: water is never quite even."""
FLOW_PATIENCE = 60.0
"""s that water gets to come to the speed that the campaign is meant for, before the preflight calls it a failure."""
UNSEEN = 60.0
"""s for which a campaign that nobody has started waits without any front end: it holds the bench."""


def connect(session: Session) -> None:
    """Open the devices one by one, and say how it went; a device that fails ends the campaign here."""
    failures: dict[str, str] = {}
    names = tuple(session.bench.instruments)
    for name in names:
        session.status.checks = device_checks(session.bench.identities, failures, names)
        session.turn()
        try:
            session.say("info", f"{name}: {session.bench.open_device(name)}", of_bench=True)
        except (LinkError, DeviceError) as error:
            failures[name] = str(error)
            session.say("error", str(error))
        if name == session.campaign.bench.motor and name not in failures:
            session.motor = session.bench.motor
    session.status.checks = device_checks(session.bench.identities, failures, names)
    if failures:
        session.turn()
        raise DeviceError(next(iter(failures.values())))
    _require_same_devices(session)


def _require_same_devices(session: Session) -> None:
    """A resumed campaign goes on with the devices it began with (docs/reliability.md, promise 23)."""
    begun: dict[str, str] = next((fact["identities"] for fact in session.before if fact["fact"] == "start"), {})
    for name, identity in session.bench.identities.items():
        if begun.get(name, identity) != identity:
            raise DeviceError(
                f"{name} is {identity}, but the campaign was begun with {begun[name]}: put that back, or begin anew"
            )


def preflight(session: Session) -> None:
    """Judge the bench until the operator starts it; the checks go on while he looks."""
    streams = [stream for _, stream in session.bench.streams()]
    devices, armed = list(session.status.checks), armed_checks(disarmed(session.campaign, streams))
    armed.append(consistency_check(session.loop.motor_watch.consistency))
    flow = Flow(session.campaign.flow_speed, session.loop.now + FLOW_PATIENCE)
    session.turn_for(SETTLE_ROWS * max(stream.period_s for stream in streams))
    started, seen = False, session.loop.now
    while not started:
        requests = session.turn()
        session.status.state = "preflight"
        seen = session.loop.now if session.loop.clients.connected else seen
        if session.loop.now - seen > UNSEEN:
            raise Stopped("aborted", f"nobody started the campaign, and no front end was there for {UNSEEN:g} s")
        checks = armed + all_checks(
            session.campaign.bench,
            session.loop.readings,
            session.bench.motor.watchdog,
            session.loop.now,
            proving=session.campaign.prove_watchdog,
        )
        checks += flow.checks(session.loop.readings, session.loop.now)
        session.status.checks = devices + checks
        failed = [check for check in checks if check.verdict in ("failed", "waiting")]
        if any(request.kind == "start" for request in requests):
            started = not failed
            if failed:
                session.say("warning", f"not started: {failed[0].name}: {failed[0].text}")
    for check in checks:
        level: Level = "warning" if check.verdict == "warning" else "info"
        session.say(level, f"preflight: {check.name}: {check.text}", of_bench=True)
    _start(session)


@dataclass
class Flow:
    """The water that the campaign is meant for, and what was measured lately."""

    wanted: float | None
    """m/s; None: whatever it is."""
    patient_until: float
    """s"""
    measured: deque[tuple[float, float]] = field(default_factory=deque)
    """s, m/s"""

    def checks(self, readings: Readings, now: float) -> list[Check]:
        """One line or none."""
        if self.wanted is None:
            return []
        values = [readings.fresh(name, now) for name, (_, _, what) in readings.place.items() if what == "flow_speed"]
        self.measured += [(now, value) for value in values if value is not None]
        while self.measured and self.measured[0][0] < now - FLOW_WINDOW:
            self.measured.popleft()
        check = flow_check(self.wanted, [value for _, value in self.measured], patient=now < self.patient_until)
        return [] if check is None else [check]


def _start(session: Session) -> None:
    session.status.started = session.loop.now
    session.status.outcome = "running"
    session.ledger.write(
        "resume" if any(fact["fact"] == "start" for fact in session.before) else "start",
        campaign=session.campaign.name,
        thrusters=session.status.thrusters,
        identities=session.bench.identities,
        **file_facts(session.campaign),
    )
    session.loop.begin_guarding()
