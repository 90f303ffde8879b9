"""The control loop: drain -> guard -> decide -> command -> publish. The only caller of MotorController.command.

Every tick re-sends the present set-point, so the motor's own watchdog is fed by a fresh tick of this loop and by
nothing else (docs/reliability.md, rule 3). What is to be commanded is decided by whoever runs the tick: idle stages or
the sequencer.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf, nan

from drivers.errors import LinkError
from drivers.protocols import MotorController, Sample
from rig.campaign.bench import COMMAND_STREAM, Bench
from rig.campaign.limits import guarded_channels
from rig.control.clocks import Clock
from rig.control.envelopes import Envelopes
from rig.control.motor_watch import MotorWatch, rest_by_thrust
from rig.control.paces import Paces
from rig.control.readings import Readings
from rig.link.clients import Clients
from rig.link.front_end_messages import Request
from rig.recording.ledger import Ledger
from rig.recording.recorder_link import RecorderLink
from rig.safety import guard
from rig.safety.guard import Recorder, Trip, Vitals
from rig.safety.lateness import Lateness
from rig.safety.lost_time import STILL, HostClocks, LostTime
from rig.safety.thrust_rest import ThrustRest
from rig.watch.watch_link import WatchLink

PUBLISH_PERIOD = 0.1
"""s between snapshots to the front ends."""


@dataclass(frozen=True, slots=True)
class Inputs:
    """What a tick has seen. Times in s on the monotonic clock."""

    now: float
    samples: tuple[Sample, ...]
    requests: tuple[Request, ...]
    trip: Trip | None
    rotation: float | None
    """rev/s, newest and fresh; None otherwise."""
    thrust_rest: bool | None = None
    """Whether the force sensor says that nothing pushes; None: it is no witness."""
    push: float | None = None
    """N from the tare; None: not known."""
    current_rest: bool | None = None
    """Whether the current drives nothing; None: not known, or not asked for."""


@dataclass(frozen=True, slots=True)
class Decision:
    """What to send in this tick: volts, or None for nothing; `release` uses the second way to stop as well."""

    volts: float | None
    release: bool = False


IDLE = Decision(0.0)


@dataclass
class Loop:
    """Runs ticks at the bench's rate. `guarded` says whether limits are judged: not before the preflight has passed."""

    bench: Bench
    readings: Readings
    recorder: RecorderLink
    ledger: Ledger
    clients: Clients
    clock: Clock
    unattended: bool
    publish: Callable[[float], None]
    watcher: WatchLink | None = None
    """Sees what is recorded; None: nobody watches."""
    host: Callable[[], HostClocks] = lambda: STILL
    """The machine's other clocks. In virtual time it neither sleeps nor is set."""
    busy: Callable[[], str] = lambda: ""
    """What this machine has to say for samples that come late; nothing in virtual time."""
    notice: Callable[[str], None] | None = None
    """Hears what an analyst should know of the machine."""
    signals: deque[Request] = field(default_factory=deque)
    """Requests that came by another way than a front end; a signal handler may append at any instant."""
    guarded: bool = False
    guarded_since: float = 0.0
    recording_since_ns: int | None = None
    """t = 0 of the open recording."""
    command: float = 0.0
    """V, last sent."""
    lateness: float = 0.0
    """s, of the running tick."""
    late: Lateness = field(default_factory=Lateness)
    """Of all ticks since the recording began."""
    thrust_rest: ThrustRest = field(default_factory=ThrustRest)
    """Of the thruster that is on the bench."""
    driven_since: float | None = None
    """s, when the command last left 0 V; None: it is 0 V."""
    has_driven: bool = False
    _command_error: str = ""
    _lapse: str = ""
    """Why a set-point was not sent."""
    _recorded_command: tuple[float | None] | None = None
    """Last row of the command stream; (None,) while nothing is sent, which is recorded as NaN."""
    _due_ns: int = 0
    _published: float = -inf
    _paces: Paces | None = None
    _sent: float | None = None
    """V of the last tick; None: nothing was sent."""
    _sent_ns: int = 0
    """When the last command went to the motor controller's driver."""

    def __post_init__(self) -> None:
        config = self.bench.config
        self.period_ns = round(1e9 / config.loop_rate)
        force = self.bench.instruments[config.force].streams[0].name
        self.thrust_channel = f"{force}.thrust"
        self.motor_watch = MotorWatch(self.bench, self.thrust_channel)
        self.rotation_channel = self.motor_watch.channel
        self.rest_by_thrust = rest_by_thrust(self.bench, self.rotation_channel)
        self.forget_tare()
        essential = [self.thrust_channel] + ([self.rotation_channel] if self.rotation_channel else [])
        streams = self.readings.streams.values()
        self.guarded_channels = guarded_channels(config.limits, streams, essential, self.thrust_channel)
        self.allowed = guard.allowances(config.loop_rate, self.bench.motor.watchdog.timeout_s)
        self.envelopes = Envelopes(streams)
        self._lost = LostTime(self.allowed.lateness + 1.0 / config.loop_rate)
        self.readings.watch_sameness(c.channel for c in self.guarded_channels if c.max_frozen is not None)

    def begin_guarding(self) -> None:
        """From now on the guard judges every tick."""
        now = self.now
        self.guarded, self.guarded_since = True, now
        self._paces = Paces(self.bench, self.readings, self.guarded_channels, now)

    @property
    def now(self) -> float:
        """Seconds on the monotonic clock."""
        return self.clock.now_ns() * 1e-9

    def tick(self, motor: MotorController | None, decide: Callable[[Inputs], Decision]) -> None:
        """One turn. `motor` None: it is not open yet, nothing is commanded."""
        now_ns = self._begin()
        now = now_ns * 1e-9
        samples = self.bench.drain()
        self.readings.update(samples)
        self.recorder.poll(now)
        requests = self._requests(now)
        self._watch_motor(tuple(samples), now)
        trip = self._judge(now, samples) if self.guarded else None
        self.thrust_rest.add(self.thrust_rows(tuple(samples), 0))
        rotation, thrust_rest = self.rotation(now), self.thrust_rest.judge(now)
        push, current_rest = self.thrust_rest.push(now), self._current_rest(now)
        decision = decide(Inputs(now, tuple(samples), requests, trip, rotation, thrust_rest, push, current_rest))
        sent = self._send(motor, decision, now) if motor is not None else decision.volts
        self._sent = sent
        self._record(samples, sent, self._sent_ns if motor is not None and sent is not None else now_ns)
        self._show(samples, now)
        self.clock.sleep_until_ns(self._due_ns)

    def zero(self, motor: MotorController) -> None:
        """0 V by both ways, now, whatever else fails."""
        self._send(motor, Decision(0.0, release=True), self.now)

    def rotation(self, now: float) -> float | None:
        """Newest rotation rate in rev/s, None when it is not measured, NaN, old or found frozen."""
        if self.rotation_channel is None or not self.motor_watch.believed:
            return None
        return self.readings.fresh(self.rotation_channel, now)

    def forget_tare(self) -> None:
        """Another thruster is on the bench, or none was yet."""
        self.thrust_rest = ThrustRest(self.rest_by_thrust.thrust if self.rest_by_thrust is not None else None)

    def _current_rest(self, now: float) -> bool | None:
        """Whether the current drives nothing; None where it is old, NaN, or the rotation rate is measured."""
        if self.rest_by_thrust is None:
            return None
        amps = self.readings.fresh(self.rest_by_thrust.channel, now)
        return None if amps is None else abs(amps) <= self.rest_by_thrust.current

    def thrust_rows(self, samples: tuple[Sample, ...], since_ns: int) -> tuple[tuple[float, float], ...]:
        """(s since `since_ns`, N) of the force device's rows, oldest first."""
        stream, column, _ = self.readings.place[self.thrust_channel]
        return tuple(
            ((sample.t_ns - since_ns) * 1e-9, sample.values[column])
            for sample in samples
            if sample.stream == stream and sample.t_ns >= since_ns
        )

    def begin_link(self) -> None:
        """The motor's link was opened, before anything may turn: what an earlier one refused is over."""
        self._command_error = ""

    def begin_recording(self, t0_ns: int) -> None:
        self.recording_since_ns, self._recorded_command = t0_ns, None
        self.motor_watch.begin_run()
        self.late.clear()

    def end_recording(self) -> None:
        self.recording_since_ns = None

    def _requests(self, now: float) -> tuple[Request, ...]:
        """Taken one by one: a signal that comes meanwhile is in this tick or in the next, and never lost."""
        requests = self.clients.poll(now)
        while self.signals:
            requests.append(self.signals.popleft())
        if any(request.kind == "stop" for request in requests):
            self._published = -inf  # whoever pressed the key is told of 0 V in this same tick
        return tuple(requests)

    def _begin(self) -> int:
        now_ns = self.clock.now_ns()
        behind = now_ns - self._due_ns if self._due_ns else 0
        self.lateness = max(behind, 0) * 1e-9
        self.late.add(self.lateness)
        self._due_ns = (self._due_ns if 0 <= behind < self.period_ns else now_ns) + self.period_ns
        self._lost.look(self.host())
        if self._lost.utc_step and self.notice is not None:
            self.notice(f"the clock of this machine was set by {self._lost.utc_step:+.3f} s; no time here is by it")
        return now_ns

    def _watch_motor(self, samples: tuple[Sample, ...], now: float) -> None:
        in_run = self.recording_since_ns is not None
        self.motor_watch.advance(samples, self._sent, self.rotation(now), now, in_run=in_run)

    def _judge(self, now: float, samples: list[Sample]) -> Trip | None:
        if self._command_error:
            cause = f"the motor did not take a command: {self._command_error}"
            return self._told(Trip(cause, "link", now, self.bench.config.motor))
        if self._lapse:
            return self._told(Trip(self._lapse, "late", now))
        if not self.unattended and self.clients.last_lease is not None and not self.clients.attending:
            return Trip("the operator is gone: the last front end has closed its connection", "lease", now)
        newest = {one.channel: self.readings.newest(one.channel) for one in self.guarded_channels}
        vitals = self._vitals(now)
        trip = guard.check(self.guarded_channels, newest, vitals, self.allowed)
        trip = trip or self.motor_watch.trip or self._pace(vitals, samples)
        return self._told(trip)

    def _pace(self, vitals: Vitals, samples: list[Sample]) -> Trip | None:
        if self._paces is None:
            return None
        return self._paces.advance(vitals, samples, commanded=self._sent is not None)

    def _told(self, trip: Trip | None) -> Trip | None:
        """With what the machine may have done to it, which changes nothing else."""
        about_time = trip is not None and (trip.source in ("stale", "late", "rate") or bool(self._command_error))
        busy = self.busy() if about_time else ""
        return replace(trip, cause=f"{trip.cause}; {busy}") if trip is not None and busy else trip

    def _vitals(self, now: float) -> Vitals:
        links = {name: instrument.health() for name, instrument in self.bench.instruments.items()}
        lease = None if self.unattended else self.clients.lease_age(now)
        driven = 0.0 if self.driven_since is None else now - self.driven_since
        recorder = Recorder(self.recorder.failed, self.recorder.silence(now), self.recorder.free_bytes)
        error, slept = self.ledger.error, self._lost.slept
        return Vitals(now, self.guarded_since, self.lateness, links, recorder, error, lease, driven, slept)

    def _send(self, motor: MotorController, decision: Decision, now: float) -> float | None:
        """What was sent, in V. The second way to stop is tried also when the first is refused.

        A set-point is judged once more at the last instant, and again after it: one that left old is followed by 0 V.
        """
        volts = 0.0 if decision.volts and self._lapsed() else decision.volts
        self._lost.told(self.clock.now_ns(), self.host())
        self._command(motor, volts, now)
        if volts and self._lapsed():
            volts = 0.0
            self._command(motor, volts, now)
        if decision.release:
            try:
                motor.release()
            except LinkError as error:
                self._command_error = str(error)

        return volts

    def _lapsed(self) -> bool:
        self._lapse = self._lapse or self._lost.lapse(self.clock.now_ns(), self.host())
        return bool(self._lapse)

    def _command(self, motor: MotorController, volts: float | None, now: float) -> None:
        if volts is None:
            return
        self._note_command(volts, now)
        self._sent_ns = self.clock.now_ns()
        try:
            motor.command(volts)
        except LinkError as error:
            self._command_error = str(error)

    def _note_command(self, volts: float, now: float) -> None:
        self.command = volts
        self.has_driven = self.has_driven or volts != 0.0
        if volts == 0.0:
            self.driven_since = None
        elif self.driven_since is None:
            self.driven_since = now

    def _record(self, samples: list[Sample], volts: float | None, sent_ns: int) -> None:
        since = self.recording_since_ns
        if since is None:
            return
        rows = [sample for sample in samples if sample.t_ns >= since]
        holds = None if volts is None else self.bench.holds(volts)
        if self._recorded_command != (holds,):
            self._recorded_command = (holds,)
            rows.append(Sample(COMMAND_STREAM, sent_ns, (nan if holds is None else holds,)))
        self.recorder.rows(rows)
        if self.watcher is not None:
            self.watcher.rows(rows, sent_ns * 1e-9)

    def _show(self, samples: list[Sample], now: float) -> None:
        row = self.envelopes.advance(samples, self._sent, self.recording_since_ns, now)
        if row is not None:
            self.clients.add_trace(row)
        if now - self._published >= PUBLISH_PERIOD - self.period_ns * 0.5e-9:
            self._published = now
            self.publish(now)
