"""The sequencer in virtual time, against a motor with a watchdog and a load cell with an offset."""

import random
import time
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.recording import Step as Row
from rig.campaign.dwell import FixedDwell, SteadyDwell
from rig.campaign.plan import Plan, Step, TareConfig
from rig.campaign.shapes import Interleaved, Levels, Ramp, Sine, Staircase
from rig.errors import PlanError
from rig.link.front_end_messages import LogLine, Point, Request
from rig.safety.guard import Trip
from rig.safety.watchdog_proof import ProofSettings
from rig.sequence.sequencer import Sequencer
from rig.sequence.ticks import Output, Settings, Tick

PERIOD = 0.02
SLEW = 12.0
PROOF = ProofSettings(voltage=4.0, slew=SLEW, rest_rate=0.5, watchdog_limit=1.0, coast_time=3.0)
SETTINGS = Settings("T1", 24.0, SLEW, 0.5, 3.0, TareConfig(1.0), lapse=0.27, max_std_error=0.1, max_drift=0.3)
FIXED = replace(SETTINGS, max_std_error=None, max_drift=None)


@dataclass
class World:
    """1 rev/s per volt with a lag of 0.2 s; 0.4 N/V^2; the motor lets go 0.5 s after the last command."""

    watchdog: float = 0.5
    offset: float = 0.7
    drift: float = 0.0
    lag: float = 0.2
    blind: bool = False
    runs_away: bool = False
    noise: random.Random = field(default_factory=lambda: random.Random(1))
    time: float = 0.0
    rotation: float = 0.0
    command: float = 0.0
    fed: float = 0.0

    def step(self, volts: float | None) -> None:
        self.time += PERIOD
        if volts is not None:
            self.command, self.fed = volts, self.time
        elif self.time - self.fed > self.watchdog:
            self.command = 0.0
        if not self.runs_away:
            self.rotation += (self.command - self.rotation) * PERIOD / self.lag

    def tick(self, **more) -> Tick:
        force = 0.4 * self.rotation * abs(self.rotation) + self.offset + self.drift * self.time
        rows = tuple((self.time - age, force + self.noise.gauss(0, 0.05)) for age in (0.01, 0.0))
        return Tick(self.time, rows, None if self.blind else self.rotation, **more)


@dataclass
class Ran:
    outputs: list[Output] = field(default_factory=list)
    times: list[float] = field(default_factory=list)

    @property
    def last(self) -> Output:
        return self.outputs[-1]

    def gathered(self, name: str) -> list:
        return [item for output in self.outputs for item in getattr(output, name)]

    @property
    def points(self) -> list[Point]:
        return self.gathered("points")

    @property
    def rows(self) -> list[Row]:
        return self.gathered("rows")

    @property
    def events(self) -> list[LogLine]:
        return self.gathered("events")

    def said(self, text: str) -> bool:
        return any(text in event.text for event in self.events)


def run(steps, settings=SETTINGS, world=None, at=None, ticks=60_000) -> Ran:
    """Advance until done. `at`: tick number -> what else is in that tick (trip, requests)."""
    world, at, sequencer, ran = world or World(), at or {}, Sequencer(steps, settings), Ran()
    for number in range(ticks):
        output = sequencer.advance(world.tick(**at.get(number, {})))
        ran.outputs.append(output)
        ran.times.append(world.time)
        if output.done:
            break
        world.step(output.volts)
    return ran


def asks(*kinds: str) -> dict:
    return {"requests": tuple(Request(kind) for kind in kinds)}


def in_state(ran: Ran, state: str, skip: int = 5) -> int:
    """Number of a tick that is in `state`, `skip` ticks into it."""
    return next(i for i, o in enumerate(ran.outputs) if o.state == state) + skip


SHORT = Plan(Interleaved(8.0, 2), FixedDwell(1.0), slew=SLEW, zero_every=2, rest=0.5, tare=TareConfig(1.0))
STEADY = Plan(Staircase(10.0, 3), SteadyDwell(1.0, 4.0, 0.1, 0.3), slew=SLEW, tare=TareConfig(1.0))
TRIP = Trip("motor.current is 55 A, above its limit of 40 A", "limit", 0.0)


def test_whole_run_measures_every_level_and_ends_at_measured_rest():
    ran = run(STEADY, replace(SETTINGS, proof=PROOF))
    assert ran.last.outcome == "completed"
    assert ran.last.stop_confirmed is True
    assert ran.last.volts == 0.0
    assert [p.voltage for p in ran.points] == [s.voltage for s in STEADY if s.phase == "hold"]
    for point in ran.points:
        assert point.thrust == pytest.approx(0.4 * point.voltage * abs(point.voltage), abs=0.6)
        assert point.thruster == "T1"
    assert ran.last.tare == pytest.approx(0.7, abs=0.02)


def test_rows_are_the_plan_as_really_run():
    ran = run(SHORT, FIXED)
    assert [(r.index, r.phase) for r in ran.rows[:-1]] == [(s.index, s.phase) for s in SHORT]
    assert (ran.rows[-1].phase, ran.rows[-1].command_voltage) == ("rest", 0.0)  # waiting for measured rest
    for before, after in pairwise(ran.rows):
        assert before.t_end == after.t_start
    hold = next(r for r in ran.rows if r.phase == "hold")
    assert hold.t_end - hold.t_start == pytest.approx(1.0, abs=PERIOD)


def test_duration_is_as_the_plan_says():
    ran = run(SHORT, FIXED)
    assert ran.times[-1] == pytest.approx(SHORT.duration().expected, rel=0.05)
    assert ran.outputs[0].remaining == pytest.approx(SHORT.duration().expected)
    assert ran.last.remaining == 0.0


def test_ten_minutes_of_staircase_in_virtual_time_take_seconds_at_most():
    plan = Plan(Staircase(20.0, 15), FixedDwell(8.0), slew=SLEW, tare=TareConfig(1.0))
    sequencer = Sequencer(plan, FIXED)
    ticks = [Tick(i * PERIOD, ((i * PERIOD, random.Random(i).gauss(0, 0.01)),), 0.0) for i in range(30_000)]
    start = time.process_time()
    states = {sequencer.advance(tick).state for tick in ticks}
    assert time.process_time() - start < 3.0
    assert "hold" in states


def test_first_command_is_zero_even_for_a_plan_that_starts_high():
    ran = run([Step(0, "hold", 5.0, 1.0, 1.0)], FIXED)
    assert ran.outputs[0].volts == 0.0
    assert ran.outputs[0].state == "ramp"
    assert ran.points[0].voltage == 5.0


def test_ticks_must_not_run_backwards():
    sequencer = Sequencer(SHORT, SETTINGS)
    sequencer.advance(Tick(1.0))
    with pytest.raises(ValueError, match="must not run backwards"):
        sequencer.advance(Tick(0.9))
    with pytest.raises(ValueError, match="must be finite"):
        sequencer.advance(Tick(nan))


def test_two_ticks_at_one_instant_are_one():
    sequencer = Sequencer(SHORT, SETTINGS)
    first, second = (sequencer.advance(Tick(1.0)) for _ in range(2))
    assert (second.state, second.volts, second.step_elapsed) == (first.state, first.volts, first.step_elapsed)


@pytest.mark.parametrize(("gap", "outcome"), [(0.25, "running"), (0.26, "tripped")])
def test_a_tick_may_be_as_late_as_is_allowed(gap, outcome):
    sequencer = Sequencer(SHORT, replace(SETTINGS, lapse=0.25))
    sequencer.advance(Tick(1.0))
    assert sequencer.advance(Tick(1.0 + gap)).outcome == outcome


def test_steps_beyond_the_range_and_no_steps_are_refused():
    with pytest.raises(PlanError, match="commands 30 V, but at most 24 V"):
        Sequencer([Step(0, "hold", 30.0, 1.0, 1.0)], SETTINGS)
    with pytest.raises(PlanError, match="no steps"):
        Sequencer([], SETTINGS)


def test_hold_that_never_gets_steady_says_so():
    plan = replace(STEADY, shape=Levels((3.0,)))
    ran = run(plan, replace(SETTINGS, tare=TareConfig(1.0, 9.0, 9.0)), World(drift=2.0))
    assert [point.steady for point in ran.points] == [False]
    assert ran.points[0].duration == pytest.approx(4.0, abs=PERIOD)
    assert ran.said("not steady, step 3 at 3 V")


def test_hold_without_samples_gives_no_point():
    sequencer, outputs = Sequencer([Step(0, "hold", 0.0, 0.5, 0.5)], FIXED), []
    outputs = [sequencer.advance(Tick(i * PERIOD, ((i * PERIOD, nan),), 0.0)) for i in range(60)]
    assert not any(o.points for o in outputs)
    assert any("no point" in e.text for o in outputs for e in o.events)


def test_first_tare_must_be_stable():
    ran = run(SHORT, FIXED, World(drift=0.5))
    assert ran.last.outcome == "tripped"
    assert "tare attempt 3 of 3 is not stable" in ran.last.cause
    assert {o.volts for o in ran.outputs} == {0.0}
    assert [r.phase for r in ran.rows] == ["free", "free", "free", "rest"]


def test_later_tare_that_is_not_stable_leaves_the_one_before():
    world, sequencer, seen = World(), Sequencer(SHORT, FIXED), []
    for _ in range(5000):
        world.drift = 0.0 if not seen or seen[-1].step < 3 else 0.5
        seen.append(sequencer.advance(world.tick()))
        if seen[-1].done:
            break
        world.step(seen[-1].volts)
    assert seen[-1].outcome == "completed"
    assert seen[-1].tare == pytest.approx(0.7, abs=0.02)
    assert any("stays in use" in e.text for o in seen for e in o.events)


def test_sine_and_sweep_follow_their_curves():
    ran = run(Plan(Sine(5.0, (0.2,), 2, offset=2.0), FixedDwell(1.0), slew=SLEW), FIXED)
    wave = [o.volts for o in ran.outputs if o.state == "sine"]
    assert max(wave) == pytest.approx(7.0, abs=0.01)
    assert min(wave) == pytest.approx(-3.0, abs=0.01)
    ran = run(Plan(Ramp(6.0, 2.0), FixedDwell(1.0), slew=SLEW), FIXED)
    sweeps = [r for r in ran.rows if r.phase == "ramp"]
    assert [r.command_voltage for r in sweeps] == [6.0, -6.0, 0.0]
    assert [r.t_end - r.t_start for r in sweeps] == pytest.approx([3.0, 6.0, 3.0], abs=2 * PERIOD)


def test_free_step_takes_its_time_and_gives_no_point():
    ran = run([Step(0, "free", 0.0, 1.0, 1.0)], FIXED)
    assert [r.phase for r in ran.rows] == ["free", "rest"]
    assert ran.points == []


def test_rest_waits_for_the_propeller_and_says_when_it_does_not_stop():
    slow = run(SHORT, FIXED, World(lag=0.8))
    rest = next(r for r in slow.rows if r.phase == "rest")
    assert rest.t_end - rest.t_start > 1.0
    plan = [Step(0, "rest", 0.0, 0.5, 1.0)]
    assert run(plan, FIXED, World(rotation=3.0, runs_away=True)).said("not at rest after 1.0 s at 0 V")


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-24, 24), min_size=1, max_size=5), st.floats(6.0, 24.0), st.integers(0, 3))
def test_never_faster_than_the_slew(voltages, slew, zero_every):
    plan = Plan(Levels(tuple(voltages)), FixedDwell(0.4, 0.1), slew=slew, zero_every=zero_every, tare=TareConfig(0.4))
    ran = run(plan, replace(FIXED, slew=slew, tare=TareConfig(0.4, 1.0, 9.0)))
    commands = [0.0] + [o.volts for o in ran.outputs]
    assert max(abs(b - a) for a, b in pairwise(commands)) <= slew * PERIOD + 1e-6
    assert ran.last.outcome == "completed"
    assert [p.voltage for p in ran.points] == voltages
