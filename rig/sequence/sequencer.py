"""The sequencer of one run: (time, thrust, rotation, trip, requests) -> volts. A transition table in virtual time.

It owns no clock and opens nothing: the same ticks give the same commands. The command never moves faster than the slew,
except to 0 V, where every stop, trip, pause and lapse goes at once. The first command of a run is 0 V.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import copysign, isfinite, pi, sin
from types import MappingProxyType

from rig.campaign.plan import Step
from rig.campaign.step_order import places, require_steps
from rig.campaign.waits import Wait
from rig.link.front_end_messages import State
from rig.safety.stopping import Stop
from rig.safety.watchdog_proof import Proof, Refused
from rig.sequence import standing
from rig.sequence.holding import Holding
from rig.sequence.journal import Journal
from rig.sequence.requests import obey
from rig.sequence.taring import Taring
from rig.sequence.ticks import EPSILON, Outcome, Output, Settings, Tick, settings_for
from rig.sequence.time_left import TimeLeft
from rig.sequence.waiting import Waiting

__all__ = ["Sequencer", "settings_for"]


class Sequencer:
    """One run of one thruster, advanced once per control period. Raises PlanError for steps it may not run."""

    def __init__(self, steps: Iterable[Step], settings: Settings) -> None:
        self.steps = tuple(steps)
        self.settings = settings
        require_steps(self.steps, settings.max_voltage)
        self._places = places(self.steps)
        self._time_left = TimeLeft(self.steps, settings.proof.expected if settings.proof else 0.0)
        self.state: State = "tare"
        self.position = 0
        self._command = 0.0
        self._silent = False
        self._last: float | None = None
        self._dt = 0.0
        self.since = 0.0
        self._target = 0.0
        self._rate = settings.slew
        self._approach = False
        self.holding = Holding(0.0, self.steps[0], settings)
        self.taring = Taring(0.0, 0.0, settings.tare, settings.estimator)
        self.waiting = Waiting(0.0, Wait())
        self._why_paused, self._paused_for = "", 0.0
        self.tare: float | None = None
        self._proof: Proof | None = None
        self._prove_before = settings.proofs_before(step.phase for step in self.steps)
        self._time_to_zero: float | None = None
        self._stop = self._new_stop(0.0)
        self._outcome: Outcome = "running"
        self._cause = ""
        self._trip_told = self._release = False
        self._stop_confirmed: bool | None = None
        self.journal = Journal()

    def advance(self, tick: Tick) -> Output:
        """Decide one tick. Raises ValueError when time runs backwards or is not finite."""
        if not isfinite(tick.time) or (self._last is not None and tick.time < self._last):
            raise ValueError(f"tick time must be finite and must not run backwards: {tick.time} s after {self._last} s")
        self.journal.clear()
        if self._last is None:
            self._last = tick.time
            self.begin(tick.time)
        self._dt, self._last = tick.time - self._last, tick.time
        self._paused_for += self._dt if self.state == "paused" else 0.0
        self._interrupt(tick)
        while (handler := HANDLERS.get(self.state)) and handler(self, tick):
            self._dt = 0.0
        return self._output(tick.time)

    def _interrupt(self, tick: Tick) -> None:
        if self.state == "run_done":
            return
        if tick.trip:
            self._tripped(tick.time, tick.trip.cause)
        if self.state not in ("paused", "stopping") and self._dt > self.settings.lapse:
            cause = f"the control loop gave no tick for {self._dt:.2f} s, {self.settings.lapse:.2f} s are allowed"
            self._tripped(tick.time, cause)
        for request in tick.requests:
            if self.state != "stopping":
                obey(self, request, tick.time)

    def _tripped(self, time: float, cause: str) -> None:
        """Stop for this cause; during a stop that is already going on it is only told, once."""
        if self.state != "stopping":
            self.halt(time, "tripped", cause)
        elif not self._trip_told:
            self.journal.say(time, "trip", f"while stopping: {cause}")
        self._trip_told = True

    @property
    def step(self) -> Step:
        """The one under way."""
        return self.steps[self.position]

    @property
    def place(self) -> str:
        """Which step of the plan that is, for people: they count from 1."""
        return f"step {self._places[self.position] + 1}"

    def waits_for(self, time: float) -> str:
        """In a wait or a pause: what for."""
        return self.waiting.reason(time) if self.state == "wait" else self._why_paused

    def halt(self, time: float, outcome: Outcome, cause: str) -> None:
        """Command 0 V at once and wait for rest."""
        self.end_row(time, cut=True)
        self.zero(time, "stopping")
        self._outcome, self._cause = outcome, cause
        self.journal.say(time, "trip" if outcome == "tripped" else "warning", f"{cause}: command 0 V")

    def pause(self, time: float, why: str) -> None:
        """Command 0 V at once and wait for an operator."""
        self.end_row(time, cut=True)
        self.zero(time, "paused")
        self._why_paused = why

    def zero(self, time: float, state: State) -> None:
        self.state, self.since, self._command, self._silent = state, time, 0.0, False
        self._stop = self._new_stop(time)

    def _new_stop(self, time: float) -> Stop:
        settings = self.settings
        return Stop(time, settings.rest_rate, settings.coast_time, without_rate=settings.without_rate)

    def begin(self, time: float) -> None:
        """Begin the step at the present position, by an approach ramp where the command is elsewhere."""
        self.since = time
        step = self.step
        if self.settings.proof is not None and self._prove_before[:1] in (("start",), (step.doing,)):
            self._proof, self.state = Proof(self.settings.proof), "proving"
            return
        entry = step.from_voltage if step.swept else step.voltage
        self._approach = (step.phase != "ramp" or step.swept) and abs(self._command - entry) > EPSILON
        if self._approach:
            self.state, self._target, self._rate = "ramp", entry, self.settings.slew
            return
        self.state, self._target = step.phase, step.voltage
        if step.wait is not None:
            self.state, self.waiting = "wait", Waiting(time, step.wait)
            self.journal.say(time, "info", f"waits at 0 V: {step.wait}")
        self.holding = Holding(time, step, self.settings)
        self.taring = Taring(time, step.min_duration, self.settings.tare, self.settings.estimator)
        travel = abs(step.voltage - step.from_voltage)
        self._rate = travel / step.min_duration if step.swept else self.settings.slew

    def next_step(self, time: float) -> None:
        self.end_row(time)
        if not self._approach:
            if self.position == len(self.steps) - 1:
                self.zero(time, "stopping")
                self._outcome = "completed"
                return
            self.position += 1
        self.begin(time)

    def stand_still(self) -> None:
        """No time passes in what is left of this tick: the command stays."""
        self._dt = 0.0

    def leave_step(self, time: float) -> None:
        """Go on without what this step has measured."""
        self.end_row(time, cut=True)
        self.since = time
        self.next_step(time)

    def finish_step(self, time: float) -> None:
        """End a step that has measured: a hold gives its point."""
        if self.state == "hold":
            point = self.holding.point(time, self.tare or 0.0)
            if point is not None:
                self.journal.points.append(point)
            if point is None or not point.steady:
                self.journal.say(time, "warning", f"{'not steady' if point else 'no point'}, {self.holding}")
        self.next_step(time)

    def end_row(self, time: float, cut: bool = False) -> None:
        self.journal.row(self.state, self.step, self._command, self.since, time, cut=cut)

    # one handler per state; True: the state has changed, ask the new one in this same tick

    def _proving(self, tick: Tick) -> bool:
        assert self._proof is not None
        volts, verdict = self._proof.advance(tick.time, tick.push if self.settings.without_rate else tick.rotation)
        self._silent, self._command = volts is None, volts or 0.0
        if verdict is None:
            return False
        if isinstance(verdict, Refused):
            self.halt(tick.time, "tripped", verdict.cause)
            return True
        self._time_to_zero = verdict.time_to_zero_s
        self.journal.say(tick.time, "info", f"watchdog proved: at rest {verdict.time_to_zero_s:.2f} s after silence")
        self.end_row(tick.time)
        self._prove_before = self._prove_before[1:]
        self.begin(tick.time)
        return True

    def _ramping(self, tick: Tick) -> bool:
        gap, most = self._target - self._command, self._rate * self._dt
        if abs(gap) <= most + EPSILON:
            self._command = self._target
            self.next_step(tick.time)
            return True
        self._command += copysign(most, gap)
        return False

    def _hold(self, tick: Tick) -> bool:
        if not self.holding.advance(tick.time, tick.thrust):
            return False
        self.finish_step(tick.time)
        return True

    def _waving(self, tick: Tick) -> bool:
        step = self.step
        elapsed = tick.time - self.since
        value = step.voltage + step.amplitude * sin(2 * pi * step.frequency * elapsed)
        most = self.settings.slew * self._dt
        self._command += min(max(value - self._command, -most), most)
        return self._timed(tick)

    def _timed(self, tick: Tick) -> bool:
        if tick.time - self.since < self.step.max_duration - EPSILON:
            return False
        self.next_step(tick.time)
        return True

    def _stopping(self, tick: Tick) -> bool:
        """0 V until measured rest."""
        confirmed, self._release = self._stop.advance(tick.time, tick.rotation, tick.thrust_rest, tick.current_rest)
        if confirmed is not None:
            self.end_row(tick.time)
            self._stop_confirmed, self.state = confirmed, "run_done"
            after = f"{tick.time - self.since:.2f} s after command 0 V: {standing.motion(self, tick)}"
            text = f"at rest {after}" if confirmed else f"STOP NOT CONFIRMED {after}; cut the power"
            self.journal.say(tick.time, "info" if confirmed else "error", text)
        return False

    def _output(self, time: float) -> Output:
        in_state = time - self.since
        elapsed = 0.0 if self.state == "paused" else in_state  # the step is taken again from its beginning
        left = self._time_left.of_run(self.position, self.state, elapsed, len(self._prove_before))
        return Output(
            volts=None if self._silent else self._command,
            state=self.state,
            step=self._places[self.position],
            steps=self._places[-1] + 1,
            step_elapsed=elapsed,
            step_expected=self._time_left.of_step(self.position, self.state),
            remaining=left if self._outcome == "running" else 0.0,
            reason=self.waits_for(time) if self.state in ("wait", "paused") else "",
            state_elapsed=in_state if self.state in ("wait", "paused") else 0.0,
            paused_for=self._paused_for,
            release=self._release,
            points=tuple(self.journal.points),
            rows=tuple(self.journal.rows),
            events=tuple(self.journal.events),
            given_up=tuple(self.journal.given_up),
            tare=self.tare,
            time_to_zero_s=self._time_to_zero,
            outcome=self._outcome,
            cause=self._cause,
            stop_confirmed=self._stop_confirmed,
            done=self.state == "run_done",
        )


HANDLERS: Mapping[State, Callable[[Sequencer, Tick], bool]] = MappingProxyType(
    {
        "proving": Sequencer._proving,
        "tare": standing.take_tare,
        "ramp": Sequencer._ramping,
        "hold": Sequencer._hold,
        "rest": standing.rest,
        "wait": standing.wait,
        "sine": Sequencer._waving,
        "free": Sequencer._timed,
        "stopping": Sequencer._stopping,
    }
)
"""Transition table: what a state does in a tick. `paused` and `run_done` wait."""
