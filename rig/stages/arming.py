"""Before a propeller may turn: open the devices, judge the bench until the operator starts it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from rig.campaign.disarmed import disarmed
from rig.control.event_log import Level
from rig.control.readings import Readings
from rig.link.front_end_messages import Check
from rig.recording.ledger import file_facts
from rig.stages.connecting import Links
from rig.stages.preflight import all_checks, armed_checks, calibration_checks, consistency_check, flow_check
from rig.stages.session import Session, Stopped

SETTLE_ROWS = 5
"""Rows of the slowest stream that are waited for before the preflight judges rates."""
FLOW_WINDOW = 3.0
"""s of measured flow that the preflight takes the mean of: water is never quite even."""
FLOW_PATIENCE = 60.0
"""s that water gets to come to the speed that the campaign is meant for, before the preflight calls it a failure."""
UNSEEN = 60.0
"""s for which a campaign that nobody has started waits without any front end: it holds the bench."""


def preflight(session: Session) -> None:
    """Open the devices, then judge the bench until the operator starts it; the checks go on while he looks.

    A device that does not open, or is lost, is tried again and again: nothing has begun, and the folder stays this one.
    """
    links = Links(session)
    links.open_all()
    streams = [stream for _, stream in session.bench.streams()]
    armed = armed_checks(disarmed(session.campaign, streams))
    armed += calibration_checks(session.campaign.bench.calibration, session.today())
    flow = Flow(session.campaign.flow_speed, session.loop.now + FLOW_PATIENCE)
    if not links.failures:
        session.turn_for(SETTLE_ROWS * max(stream.period_s for stream in streams))
    seen = session.loop.now
    while True:
        requests = session.turn()
        session.status.state = "preflight"
        seen = session.loop.now if session.loop.clients.attending else seen
        if session.loop.now - seen > UNSEEN:
            raise Stopped("aborted", f"nobody started the campaign, and no front end was there for {UNSEEN:g} s")
        links.look(requests)
        checks = [*armed, *_bench_checks(session, links), *flow.checks(session.loop.readings, session.loop.now)]
        session.status.checks = [*links.checks, *checks]
        if any(request.kind == "start" for request in requests):
            against = [check for check in session.status.checks if check.verdict in ("failed", "waiting")]
            if not against:
                break
            name = against[0].name
            session.say("warning", f"not started: {name}: {against[0].text.removeprefix(f'{name}: ')}")
    for check in checks:
        level: Level = "warning" if check.verdict == "warning" else "info"
        session.say(level, f"preflight: {check.name}: {check.text}", of_bench=True)
    _start(session)


def _bench_checks(session: Session, links: Links) -> list[Check]:
    """What the devices send; nothing of those that are not there, whose own line says so."""
    gone = {s.name for name in links.failures for s in session.bench.instruments[name].streams}
    checks = all_checks(
        session.campaign.bench,
        session.loop.readings,
        session.bench.motor.watchdog,
        session.loop.now,
        proving=session.campaign.prove_watchdog,
        without=gone,
    )
    return [consistency_check(session.loop.motor_watch.consistency), *checks]


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
