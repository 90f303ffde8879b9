"""The sequencer of one run: (time, thrust, rotation, trip, requests) -> volts. A transition table in virtual time.

It owns no clock and opens nothing: the same ticks give the same commands. The command never moves faster than the slew,
except to 0 V, where every stop, trip, pause and lapse goes at once. The first command of a run is 0 V.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import accumulate
from math import copysign, isfinite, pi, sin
from types import MappingProxyType

from rig.campaign.plan import Step, places, require_steps
from rig.link.front_end_messages import State
from rig.safety.stopping import Stop, is_rest, turning
from rig.safety.watchdog_proof import Proof, Refused
from rig.sequence.holding import Holding
from rig.sequence.journal import Journal
from rig.sequence.requests import obey
from rig.sequence.taring import Taring
from rig.sequence.ticks import Outcome, Output, Settings, Tick, settings_for

__all__ = ["Sequencer", "settings_for"]

EPSILON = 1e-9
"""s and V, slack for float arithmetic."""


class Sequencer:
    """One run of one thruster, advanced once per control period. Raises PlanError for steps it may not run."""

    def __init__(self, steps: Iterable[Step], settings: Settings) -> None:
        self.steps = tuple(steps)
        self._settings = settings
        require_steps(self.steps, settings.max_voltage)
        self._places = places(self.steps)
        self._after = tuple(accumulate((s.expected for s in reversed(self.steps)), initial=0.0))[-2::-1]
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
        self._taring = Taring(0.0, 0.0, settings.tare, settings.estimator)
        self._tare: float | None = None
        self._proof: Proof | None = None
        self._prove_before = settings.proofs_before(step.phase for step in self.steps)
        self._time_to_zero: float | None = None
        self._stop = Stop(0.0, settings.rest_rate, settings.coast_time)
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
        self._interrupt(tick)
        while (handler := HANDLERS.get(self.state)) and handler(self, tick):
            self._dt = 0.0
        return self._output(tick.time)

    def _interrupt(self, tick: Tick) -> None:
        if self.state == "run_done":
            return
        if tick.trip:
            self._tripped(tick.time, tick.trip.cause)
        if self.state not in ("paused", "stopping") and self._dt > self._settings.lapse:
            cause = f"the control loop gave no tick for {self._dt:.2f} s, {self._settings.lapse:.2f} s are allowed"
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

    def halt(self, time: float, outcome: Outcome, cause: str) -> None:
        """Command 0 V at once and wait for rest."""
        self.end_row(time, cut=True)
        self.zero(time, "stopping")
        self._outcome, self._cause = outcome, cause
        self.journal.say(time, "trip" if outcome == "tripped" else "warning", f"{cause}: command 0 V")

    def zero(self, time: float, state: State) -> None:
        self.state, self.since, self._command, self._silent = state, time, 0.0, False
        self._stop = Stop(time, self._settings.rest_rate, self._settings.coast_time)

    def begin(self, time: float) -> None:
        """Begin the step at the present position, by an approach ramp where the command is elsewhere."""
        self.since = time
        step = self.step
        if self._settings.proof is not None and self._prove_before[:1] in (("start",), (step.phase,)):
            self._proof, self.state = Proof(self._settings.proof), "proving"
            return
        entry = step.from_voltage if step.swept else step.voltage
        self._approach = (step.phase != "ramp" or step.swept) and abs(self._command - entry) > EPSILON
        if self._approach:
            self.state, self._target, self._rate = "ramp", entry, self._settings.slew
            return
        self.state, self._target = step.phase, step.voltage
        self.holding = Holding(time, step, self._settings)
        self._taring = Taring(time, step.min_duration, self._settings.tare, self._settings.estimator)
        travel = abs(step.voltage - step.from_voltage)
        self._rate = travel / step.min_duration if step.swept else self._settings.slew

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
            point = self.holding.point(time, self._tare or 0.0)
            if point is not None:
                self.journal.points.append(point)
            if point is None or not point.steady:
                self.journal.say(time, "warning", f"{'not steady' if point else 'no point'}, {self.holding}")
        self.next_step(time)

    def end_row(self, time: float, cut: bool = False) -> None:
        volts = self._target if self.state == "ramp" and not cut else self._command
        self.journal.row(self.state, self.step, volts, self.since, time, cut=cut)

    # one handler per state; True: the state has changed, ask the new one in this same tick

    def _proving(self, tick: Tick) -> bool:
        assert self._proof is not None
        volts, verdict = self._proof.advance(tick.time, tick.rotation)
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

    def _zeroing(self, tick: Tick) -> bool:
        """The first tare must be stable; a later one that is not leaves the one before in use."""
        verdict, mean, text = self._taring.advance(tick.time, tick.thrust)
        match verdict:
            case "waiting":
                return False
            case "accepted":
                self._tare = mean
                self.journal.say(tick.time, "info", text)
                self.next_step(tick.time)
            case "failed" if self._tare is None:
                self.halt(tick.time, "tripped", text)
            case _:
                kept = f"; the last tare of {self._tare:.4f} N stays in use" if verdict == "failed" else ""
                self.journal.say(tick.time, "warning", text + kept)
                self.end_row(tick.time, cut=True)
                self.since = tick.time
                if verdict == "failed":
                    self.next_step(tick.time)
        return verdict != "again"

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

    def _resting(self, tick: Tick) -> bool:
        step = self.step
        elapsed, at_rest = tick.time - self.since + EPSILON, is_rest(tick.rotation, self._settings.rest_rate)
        if elapsed >= step.max_duration or (elapsed >= step.min_duration and at_rest):
            if not at_rest:
                text = f"not at rest after {elapsed:.1f} s at 0 V: {turning(tick.rotation)}"
                self.journal.say(tick.time, "warning", text)
            self.next_step(tick.time)
            return True
        return False

    def _waving(self, tick: Tick) -> bool:
        step = self.step
        elapsed = tick.time - self.since
        value = step.voltage + step.amplitude * sin(2 * pi * step.frequency * elapsed)
        most = self._settings.slew * self._dt
        self._command += min(max(value - self._command, -most), most)
        return self._timed(tick)

    def _timed(self, tick: Tick) -> bool:
        if tick.time - self.since < self.step.max_duration - EPSILON:
            return False
        self.next_step(tick.time)
        return True

    def _stopping(self, tick: Tick) -> bool:
        """0 V until measured rest."""
        confirmed, self._release = self._stop.advance(tick.time, tick.rotation, tick.thrust_rest)
        if confirmed is not None:
            self.end_row(tick.time)
            self._stop_confirmed, self.state = confirmed, "run_done"
            after = f"{tick.time - self.since:.2f} s after command 0 V: {turning(tick.rotation, tick.thrust_rest)}"
            text = f"at rest {after}" if confirmed else f"STOP NOT CONFIRMED {after}; cut the power"
            self.journal.say(tick.time, "info" if confirmed else "error", text)
        return False

    def _output(self, time: float) -> Output:
        step, elapsed = self.step, time - self.since
        once = self._settings.proof.expected if self._settings.proof else 0.0
        expected, after = step.expected, self._after[self.position] + once * len(self._prove_before)
        if self.state == "proving":
            expected, after = once, expected + after - once
        return Output(
            volts=None if self._silent else self._command,
            state=self.state,
            step=self._places[self.position],
            steps=self._places[-1] + 1,
            step_elapsed=elapsed,
            step_expected=expected,
            remaining=0.0 if self._outcome != "running" else max(expected - elapsed, 0.0) + after,
            release=self._release,
            points=tuple(self.journal.points),
            rows=tuple(self.journal.rows),
            events=tuple(self.journal.events),
            given_up=tuple(self.journal.given_up),
            tare=self._tare,
            time_to_zero_s=self._time_to_zero,
            outcome=self._outcome,
            cause=self._cause,
            stop_confirmed=self._stop_confirmed,
            done=self.state == "run_done",
        )


HANDLERS: Mapping[State, Callable[[Sequencer, Tick], bool]] = MappingProxyType(
    {
        "proving": Sequencer._proving,
        "tare": Sequencer._zeroing,
        "ramp": Sequencer._ramping,
        "hold": Sequencer._hold,
        "rest": Sequencer._resting,
        "sine": Sequencer._waving,
        "free": Sequencer._timed,
        "stopping": Sequencer._stopping,
    }
)
"""Transition table: what a state does in a tick. `paused` and `run_done` wait."""
