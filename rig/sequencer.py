"""The sequencer of one run: (time, thrust, rotation, trip, requests) -> volts. A transition table in virtual time.

It owns no clock and opens nothing: the same ticks give the same commands. The command never moves faster than the slew,
except to 0 V, where every stop, trip, pause and lapse goes at once. The first command of a run is 0 V.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import copysign, isfinite, pi, sin
from types import MappingProxyType
from typing import Literal

from identification.recording import Step as StepRow
from rig.config import BenchConfig, CampaignConfig
from rig.errors import PlanError
from rig.guard import MIN_LATENESS
from rig.messages import LogLine, Point, Request, State
from rig.plan import Phase, SteadyDwell, Step
from rig.proof import Proof, ProofSettings, Refused
from rig.steady import Window
from rig.ticks import Outcome, Output, Settings, Tick

REST_CONFIRM = 0.2
"""s of measured rest before a stop counts as confirmed: ten status messages at 50 Hz."""
EPSILON = 1e-9
"""s and V, slack for float arithmetic."""
PROOF_INDEX = -1
"""Index in `/steps` of the watchdog proof, which is no step of the plan."""


def settings_for(campaign: CampaignConfig, thruster: str) -> Settings:
    """Settings of one thruster's run."""
    bench, plan = campaign.bench, campaign.plan
    steady = plan.dwell if isinstance(plan.dwell, SteadyDwell) else None
    slew = min(plan.slew, bench.slew)
    return Settings(
        thruster=thruster,
        max_voltage=bench.max_voltage,
        slew=slew,
        rest_rate=bench.rest_rate,
        coast_time=bench.coast_time,
        tare=campaign.tare,
        lapse=max(5 / bench.loop_rate, MIN_LATENESS) + 1 / bench.loop_rate,
        max_std_error=steady.max_std_error if steady else None,
        max_drift=steady.max_drift if steady else None,
        proof=proof_settings(bench, slew) if campaign.prove_watchdog else None,
    )


def proof_settings(bench: BenchConfig, slew: float) -> ProofSettings:
    return ProofSettings(bench.proof_voltage, slew, bench.rest_rate, bench.watchdog_limit, bench.coast_time)


class Sequencer:
    """One run of one thruster, advanced once per tick of the control loop. Raises PlanError for steps it may not run."""

    def __init__(self, steps: Iterable[Step], settings: Settings) -> None:
        self._steps = tuple(steps)
        self._settings = settings
        if not self._steps:
            raise PlanError("the plan has no steps: nothing would be measured")
        for step in self._steps:
            if step.peak > settings.max_voltage:
                raise PlanError(
                    f"step {step.index} commands {step.peak:g} V, the bench allows {settings.max_voltage:g} V"
                )
        self._state: State = "tare"
        self._position = 0
        self._command = 0.0
        self._silent = False
        self._last: float | None = None
        self._since = 0.0
        self._target = 0.0
        self._rate = settings.slew
        self._approach = False
        self._window = Window(0.0, settings.estimator)
        self._attempt = 1
        self._tare: float | None = None
        self._proof = Proof(settings.proof) if settings.proof else None
        self._time_to_zero: float | None = None
        self._rest_since: float | None = None
        self._outcome: Outcome = "running"
        self._cause = ""
        self._trip_told = False
        self._release = False
        self._stop_confirmed: bool | None = None
        self._points: list[Point] = []
        self._rows: list[StepRow] = []
        self._events: list[LogLine] = []

    def advance(self, tick: Tick) -> Output:
        """Decide one tick. Raises ValueError when time runs backwards or is not finite."""
        if not isfinite(tick.time) or (self._last is not None and tick.time < self._last):
            raise ValueError(f"tick time must be finite and must not run backwards: {tick.time} s after {self._last} s")
        self._points, self._rows, self._events = [], [], []
        if self._last is None:
            self._last = tick.time
            self._begin(tick.time)
        dt, self._last = tick.time - self._last, tick.time
        self._interrupt(tick, dt)
        while HANDLERS[self._state](self, tick, dt):
            dt = 0.0
        return self._output(tick.time)

    # what comes from outside

    def _interrupt(self, tick: Tick, dt: float) -> None:
        if self._state == "run_done":
            return
        if tick.trip:
            self._tripped(tick.time, tick.trip.cause)
        if self._state not in ("paused", "stopping") and dt > self._settings.lapse:
            cause = f"the control loop gave no tick for {dt:.2f} s, {self._settings.lapse:.2f} s are allowed"
            self._tripped(tick.time, cause)
        for request in tick.requests:
            if self._state != "stopping":
                self._obey(request, tick.time)

    def _tripped(self, time: float, cause: str) -> None:
        """Stop for this cause; during a stop that is already going on it is only told, once."""
        if self._state != "stopping":
            self._halt(time, "tripped", cause)
        elif not self._trip_told:
            self._say(time, "trip", f"while stopping: {cause}")
        self._trip_told = True

    def _obey(self, request: Request, time: float) -> None:
        match request.kind:
            case "stop":
                self._halt(time, "aborted", f"stopped by {request.text or 'the operator'}")
            case "pause" if self._state != "paused":
                self._end_row(time, cut=True)
                self._zero(time, "paused")
                self._say(time, "info", f"paused in step {self._position}: command 0 V")
            case "resume" if self._state == "paused":
                self._end_row(time)
                self._say(time, "info", f"resumed: step {self._position} is retaken")
                self._begin(time)
            case "skip" if self._state in ("hold", "sine", "free"):
                self._say(time, "info", f"step {self._position} was ended early by the operator, its data are kept")
                self._finish_step(time)
            case "pause" | "resume" | "skip":
                self._say(time, "warning", f"{request.kind} was ignored: it means nothing in state {self._state}")
            case _:
                pass  # notes, leases and the like are the controller's

    def _halt(self, time: float, outcome: Outcome, cause: str) -> None:
        """Command 0 V at once and wait for rest."""
        self._end_row(time, cut=True)
        self._zero(time, "stopping")
        self._outcome, self._cause = outcome, cause
        if outcome != "completed":
            self._say(time, "trip" if outcome == "tripped" else "warning", f"{cause}: command 0 V")

    def _zero(self, time: float, state: State) -> None:
        self._state, self._since, self._command, self._silent = state, time, 0.0, False

    # going from step to step

    def _begin(self, time: float) -> None:
        """Begin the step at the present position, by an approach ramp where the command is elsewhere."""
        self._since = time
        if self._proof is not None and self._settings.proof is not None:
            self._proof, self._state = Proof(self._settings.proof), "proving"
            return
        step = self._steps[self._position]
        entry = step.from_voltage if step.swept else step.voltage
        self._approach = (step.phase != "ramp" or step.swept) and abs(self._command - entry) > EPSILON
        if self._approach:
            self._state, self._target, self._rate = "ramp", entry, self._settings.slew
            return
        self._state, self._target, self._attempt = step.phase, step.voltage, 1
        self._window = Window(time + step.settle, self._settings.estimator)
        travel = abs(step.voltage - step.from_voltage)
        self._rate = travel / step.min_duration if step.swept else self._settings.slew

    def _next(self, time: float) -> None:
        self._end_row(time)
        if not self._approach:
            if self._position == len(self._steps) - 1:
                self._zero(time, "stopping")
                self._outcome = "completed"
                return
            self._position += 1
        self._begin(time)

    def _finish_step(self, time: float) -> None:
        """End a step that has measured: a hold gives its point."""
        if self._state == "hold":
            self._take_point(time)
        self._next(time)

    def _take_point(self, time: float) -> None:
        window, step = self._window, self._steps[self._position]
        if window.count == 0:
            self._say(time, "warning", f"step {self._position} at {step.voltage:g} V has no thrust samples: no point")
            return
        thrust = window.mean - (self._tare or 0.0)
        steady = self._steady()
        point = Point(
            self._position, step.voltage, thrust, window.std_error, time - self._since, steady, self._settings.thruster
        )
        self._points.append(point)
        if not steady:
            self._say(time, "warning", f"step {self._position} at {step.voltage:g} V is not steady: {window}")

    def _steady(self) -> bool:
        """Always True for a fixed dwell, which has no thresholds."""
        error, drift = self._settings.max_std_error, self._settings.max_drift
        return error is None or drift is None or self._window.steady(error, drift)

    def _end_row(self, time: float, cut: bool = False) -> None:
        """Row for `/steps`. A hold, sine or tare that was cut short is `free`, so that nobody takes it for a whole one."""
        if time <= self._since:
            return
        step = self._steps[self._position]
        index, phase, volts = self._position, step.phase, step.voltage
        match self._state:
            case "proving":
                index, phase, volts = PROOF_INDEX, "free", self._settings.proof.voltage if self._settings.proof else 0.0
            case "paused":
                phase, volts = "rest", 0.0
            case "ramp":
                phase, volts = "ramp", self._command if cut else self._target
            case "stopping":
                phase, volts = "rest", 0.0
            case _ if cut:
                phase = "free"
        self._rows.append(StepRow(index, phase, volts, self._since, time))

    def _say(self, time: float, level: Literal["info", "warning", "trip", "error"], text: str) -> None:
        self._events.append(LogLine(time, level, text))

    # one handler per state; True: the state has changed, ask the new one in this same tick

    def _proving(self, tick: Tick, dt: float) -> bool:
        assert self._proof is not None
        volts, verdict = self._proof.advance(tick.time, tick.rotation)
        self._silent = volts is None
        self._command = 0.0 if volts is None else volts
        if verdict is None:
            return False
        if isinstance(verdict, Refused):
            self._halt(tick.time, "tripped", verdict.cause)
            return True
        self._time_to_zero = verdict.time_to_zero_s
        self._say(tick.time, "info", f"watchdog proved: at rest {verdict.time_to_zero_s:.2f} s after the last command")
        self._end_row(tick.time)
        self._proof = None
        self._begin(tick.time)
        return True

    def _taring(self, tick: Tick, dt: float) -> bool:
        window, wanted, step = self._window, self._settings.tare, self._steps[self._position]
        window.add(tick.thrust)
        if tick.time - self._since < step.min_duration - EPSILON:
            return False
        if window.steady(wanted.max_std_error, wanted.max_drift):
            self._tare = window.mean
            self._say(tick.time, "info", f"tare {window}")
            self._next(tick.time)
            return True
        allowed = f"{wanted.max_std_error:g} N and {wanted.max_drift:g} N/s are allowed"
        told = f"tare attempt {self._attempt} of {wanted.attempts} is not stable: {window}; {allowed}"
        self._attempt += 1
        if self._attempt <= wanted.attempts:
            self._say(tick.time, "warning", told)
            self._end_row(tick.time, cut=True)
            self._since, self._window = tick.time, Window(tick.time, self._settings.estimator)
            return False
        if self._tare is None:
            self._halt(tick.time, "tripped", told)
            return True
        self._say(tick.time, "warning", f"{told}; the last tare of {self._tare:.4f} N stays in use")
        self._end_row(tick.time, cut=True)
        self._since = tick.time
        self._next(tick.time)
        return True

    def _ramping(self, tick: Tick, dt: float) -> bool:
        gap, most = self._target - self._command, self._rate * dt
        if abs(gap) <= most + EPSILON:
            self._command = self._target
            self._next(tick.time)
            return True
        self._command += copysign(most, gap)
        return False

    def _holding(self, tick: Tick, dt: float) -> bool:
        step = self._steps[self._position]
        self._window.add(tick.thrust)
        elapsed = tick.time - self._since + EPSILON
        thresholds = self._settings.max_std_error is not None
        if elapsed >= step.max_duration or (thresholds and elapsed >= step.min_duration and self._steady()):
            self._finish_step(tick.time)
            return True
        return False

    def _resting(self, tick: Tick, dt: float) -> bool:
        step = self._steps[self._position]
        elapsed, at_rest = tick.time - self._since + EPSILON, self._at_rest(tick.rotation)
        if elapsed >= step.max_duration or (elapsed >= step.min_duration and at_rest):
            if not at_rest:
                self._say(tick.time, "warning", f"not at rest after {elapsed:.1f} s at 0 V: {_said(tick.rotation)}")
            self._next(tick.time)
            return True
        return False

    def _waving(self, tick: Tick, dt: float) -> bool:
        step = self._steps[self._position]
        elapsed = tick.time - self._since
        value = step.voltage + step.amplitude * sin(2 * pi * step.frequency * elapsed)
        most = self._settings.slew * dt
        self._command += min(max(value - self._command, -most), most)
        return self._timed(tick, dt)

    def _timed(self, tick: Tick, dt: float) -> bool:
        if tick.time - self._since < self._steps[self._position].max_duration - EPSILON:
            return False
        self._next(tick.time)
        return True

    def _stopping(self, tick: Tick, dt: float) -> bool:
        """0 V until measured rest; after half the coast time by the motor's second way to stop as well."""
        elapsed, coast_time = tick.time - self._since, self._settings.coast_time
        self._rest_since = (
            None if not self._at_rest(tick.rotation) else tick.time if self._rest_since is None else self._rest_since
        )
        if self._rest_since is not None and tick.time - self._rest_since >= REST_CONFIRM - EPSILON:
            self._stopped(tick.time, True, "info", f"at rest {elapsed:.2f} s after command 0 V")
        elif elapsed >= coast_time:
            text = f"STOP NOT CONFIRMED {elapsed:.2f} s after command 0 V: {_said(tick.rotation)}; cut the power"
            self._stopped(tick.time, False, "error", text)
        self._release = self._stop_confirmed is False or (self._rest_since is None and elapsed >= coast_time / 2)
        return False

    def _stopped(self, time: float, confirmed: bool, level: Literal["info", "error"], text: str) -> None:
        self._end_row(time)
        self._say(time, level, text)
        self._stop_confirmed, self._state = confirmed, "run_done"

    def _waiting(self, tick: Tick, dt: float) -> bool:
        return False

    def _at_rest(self, rotation: float | None) -> bool:
        return rotation is not None and abs(rotation) <= self._settings.rest_rate

    def _output(self, time: float) -> Output:
        step, elapsed = self._steps[self._position], time - self._since
        expected, after = step.expected, sum(s.expected for s in self._steps[self._position + 1 :])
        if self._state == "proving" and self._settings.proof:
            expected, after = self._settings.proof.expected, expected + after
        over = self._state in ("stopping", "run_done")
        return Output(
            volts=None if self._silent else self._command,
            state=self._state,
            step=self._position,
            steps=len(self._steps),
            step_elapsed=elapsed,
            step_expected=expected,
            remaining=0.0 if over else max(expected - elapsed, 0.0) + after,
            release=self._release,
            points=tuple(self._points),
            rows=tuple(self._rows),
            events=tuple(self._events),
            tare=self._tare,
            time_to_zero_s=self._time_to_zero,
            outcome=self._outcome,
            cause=self._cause,
            stop_confirmed=self._stop_confirmed,
            done=self._state == "run_done",
        )


def _said(rotation: float | None) -> str:
    return "the rotation rate is unknown" if rotation is None else f"the propeller turns {rotation:.2f} rev/s"


HANDLERS: Mapping[State, Callable[[Sequencer, Tick, float], bool]] = MappingProxyType(
    {
        "proving": Sequencer._proving,
        "tare": Sequencer._taring,
        "ramp": Sequencer._ramping,
        "hold": Sequencer._holding,
        "rest": Sequencer._resting,
        "sine": Sequencer._waving,
        "free": Sequencer._timed,
        "paused": Sequencer._waiting,
        "stopping": Sequencer._stopping,
        "run_done": Sequencer._waiting,
    }
)
