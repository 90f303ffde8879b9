"""What the stages of a campaign share: the bench, the loop, the records; and the ticks outside a run, all at 0 V."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Literal

from drivers.protocols import MotorController
from rig.campaign.bench import Bench
from rig.campaign.config import CampaignConfig
from rig.control.clocks import Clock
from rig.control.devices import Devices
from rig.control.event_log import EventLog, Level
from rig.control.loop import IDLE, Decision, Inputs, Loop
from rig.control.readings import Readings
from rig.control.status import Status
from rig.errors import LinkError
from rig.link.clients import Clients
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Outcome
from rig.link.watch_messages import Judged
from rig.recording.ledger import Fact, Ledger
from rig.recording.line_writer import LineWriter
from rig.recording.recorder_link import RecorderLink
from rig.safety.stopping import Stop, turning, without_a_rate
from rig.sequence.requests import ASKED
from rig.stages.recording_header import Stamp, fresh_stamp
from rig.watch.watch_link import WatchLink

RECORDER_WAIT = 20.0
"""s for the recorder to open or close a file, and for the disk to take that a run begins."""

PASSING = ("stale", "late", "rate")
"""Trips that end nothing while nothing is driven: the machine paused during a mount. A run's own ticks judge anew."""


class Stopped(Exception):
    """The campaign is over before its plan is: an operator, a signal or the guard said so."""

    def __init__(self, outcome: Literal["aborted", "tripped"], cause: str) -> None:
        super().__init__(cause)
        self.outcome = outcome


@dataclass
class Session:
    """One campaign on one bench. `motor` is None until its port is open."""

    campaign: CampaignConfig
    folder: Path
    status: Status
    bench: Bench
    recorder: RecorderLink
    ledger: Ledger
    log: LineWriter
    event_log: EventLog
    loop: Loop
    before: tuple[Fact, ...] = ()
    """Facts of an earlier part of this campaign, which is resumed."""
    motor: MotorController | None = None
    proved: bool = False
    """The motor's own watchdog was proved."""
    watched: bool = False
    """This run is; False once it was said why it is not."""
    judged: Judged | None = None
    """What the watcher said last, as it is on the screens."""
    measured: set[tuple[int, str]] = field(default_factory=set)
    """(index, phase) of the steps of this run that were run to their end."""
    given_up: set[int] = field(default_factory=set)
    """Indices of the steps of this run that an operator left out or marked bad: it is whole without them."""
    kept: frozenset[int] = frozenset()
    """Indices of the steps of this run that earlier recordings hold: it goes on after a cut."""
    stamp: Callable[[], Stamp] = fresh_stamp
    """Of the next recording."""
    today: Callable[[], date] = lambda: datetime.now(UTC).date()
    """UTC, against which calibrations are over."""

    def say(self, level: Level, text: str, *, of_bench: bool = False) -> None:
        self.event_log.say(self.loop.clock.now_ns(), level, text, of_bench=of_bench)

    def turn(self) -> tuple[Request, ...]:
        """One tick at zero volts; a stop request or a trip ends the campaign."""
        inputs = self._idle_tick()
        self.note(inputs.requests)
        self._refuse(inputs.requests)
        stop = next((request for request in inputs.requests if request.kind == "stop"), None)
        if stop is not None:
            raise Stopped("aborted", f"stopped by {stop.text or 'the operator'}")
        if inputs.trip is not None and inputs.trip.source not in PASSING:
            raise Stopped("tripped", inputs.trip.cause)
        return inputs.requests

    def _refuse(self, requests: tuple[Request, ...]) -> None:
        """What is asked of a run means nothing where none goes on."""
        for request in requests:
            if request.kind in ASKED:
                where = f"in state {self.status.state} no step is under way, and the command is 0 V"
                self.say("warning", f"{request.kind} ignored: {where}")

    def turn_for(self, seconds: float) -> None:
        end = self.loop.now + seconds
        while self.loop.now < end:
            self.turn()

    def wait(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Tick until `done`; LinkError that names what was waited for when it takes longer than `timeout` s."""
        end = self.loop.now + timeout
        while not done():
            self.turn()
            if self.loop.now > end:
                raise LinkError(f"waited {timeout:g} s for {what}; it did not happen")

    def wait_for_recorder(self, done: Callable[[], bool], what: str) -> None:
        """The same for the recorder; a request that comes meanwhile is kept for the next stage, a stop among them."""
        self.wait_holding(done, f"the recorder to {what}")

    def wait_holding(self, done: Callable[[], bool], what: str) -> None:
        """Tick until `done`; a request that comes meanwhile is kept for the next stage, a stop among them."""
        end = self.loop.now + RECORDER_WAIT
        held: list[Request] = []
        while not done():
            held.extend(self._idle_tick().requests)
            if self.recorder.failed and not done():
                raise LinkError(f"recorder: {self.recorder.failed}")
            if self.loop.now > end:
                raise LinkError(f"waited {RECORDER_WAIT:g} s for {what}; it did not happen")
        self.loop.signals.extendleft(reversed(held))

    def rest(self) -> None:
        """Zero by both ways, whatever came before; then wait for measured rest. Nothing ends it early.

        Says loudly when rest can't be confirmed within the coast time.
        """
        loop, config = self.loop, self.campaign.bench
        loop.guarded = False
        if self.motor is None:
            return
        known = self.status.stop_confirmed and loop.driven_since is None
        loop.zero(self.motor)
        if known or not loop.has_driven:
            return
        blind = loop.rest_by_thrust is not None
        stop = Stop(loop.now, config.rest_rate, config.coast_time, without_rate=blind)
        confirmed, release = None, True
        while confirmed is None:
            inputs = self._idle_tick(release=release)
            confirmed, release = stop.advance(inputs.now, inputs.rotation, inputs.thrust_rest, inputs.current_rest)
        self.status.stop_confirmed = confirmed
        seen = inputs.thrust_rest, inputs.current_rest
        what = without_a_rate(*seen) if blind else turning(inputs.rotation, inputs.thrust_rest)
        if confirmed:
            self.say("info", f"at rest: {what}")
        else:
            self.say("error", f"STOP NOT CONFIRMED {config.coast_time:g} s after command 0 V: {what}; cut the power")

    def note(self, requests: tuple[Request, ...]) -> None:
        """What requests leave in the records."""
        for request in requests:
            if request.kind == "note":
                self.say("info", f"note: {request.text}")
            elif request.kind == "detach":
                alone = not self.campaign.unattended and self.loop.clients.attending < 2
                self.say(
                    "warning" if alone else "info",
                    "the only front end of an attended run wants to leave: when it does, the run stops"
                    if alone
                    else "a front end detached",
                )

    def _idle_tick(self, *, release: bool = False) -> Inputs:
        seen: list[Inputs] = []
        decision = Decision(0.0, release=True) if release else IDLE

        def idle(inputs: Inputs) -> Decision:
            seen.append(inputs)
            return decision

        self.loop.tick(self.motor, idle)
        return seen[0]

    def close(self) -> None:
        """Everything is tried, whatever fails."""
        with contextlib.ExitStack() as closing:
            closing.callback(self.log.close)
            closing.callback(self.ledger.close)
            closing.callback(self._last_fact)
            closing.callback(self.recorder.shut_down)
            if self.loop.watcher is not None:
                closing.callback(self.loop.watcher.shut_down)
            closing.callback(self._close_recording)
            closing.callback(self.bench.close)
            closing.callback(self.loop.clients.close)

    def _close_recording(self) -> None:
        """One that is still open belongs to a run that did not end in order."""
        if self.loop.recording_since_ns is not None:
            outcome: Outcome = "tripped" if self.status.outcome == "tripped" else "aborted"
            self.recorder.close_file(outcome, self.status.cause)

    def _last_fact(self) -> None:
        self.ledger.write("end", outcome=self.status.outcome, cause=self.status.cause)


def begin(
    campaign: CampaignConfig,
    folder: Path,
    thrusters: tuple[str, ...],
    parts: tuple[Bench, RecorderLink, Ledger, LineWriter, Clients, Clock],
    before: tuple[Fact, ...] = (),
    watch: WatchLink | None = None,
) -> Session:
    """Put the parts of a campaign together. Nothing is opened here but what is handed in."""
    bench, recorder, ledger, log, clients, clock = parts
    status = Status(campaign, thrusters or campaign.thrusters)
    readings = Readings({stream.name: stream for _, stream in bench.streams()}, campaign.bench.limits)
    begun_ns = clock.now_ns()
    status.begun = begun_ns * 1e-9
    event_log = EventLog(status, recorder, log, begun_ns)

    devices = Devices(bench, readings)

    def publish(now: float) -> None:
        since = loop.recording_since_ns
        time = 0.0 if since is None else now - since * 1e-9
        if clients.connected:
            heard = devices.view(now, session.today, status.watchdog_measured)
            shown = status.snapshot(now, time, loop.command, readings.view(now), heard, loop.envelopes.channels)
            clients.publish(shown)

    loop = Loop(bench, readings, recorder, ledger, clients, clock, campaign.unattended, publish, watch)
    session = Session(campaign, folder, status, bench, recorder, ledger, log, event_log, loop, before)
    loop.notice = lambda text: session.say("warning", text)
    return session
