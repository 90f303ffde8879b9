"""Stop, trip, pause, resume, skip and lapse: at any instant, in any order."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_sequencer import FIXED, PERIOD, PROOF, SHORT, SLEW, TRIP, Ran, World, asks, in_state, run

from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import Plan, Step, TareConfig
from rig.campaign.shapes import Ramp, Sine
from rig.link.front_end_messages import Request
from rig.sequence.journal import Journal
from rig.sequence.sequencer import Sequencer
from rig.sequence.ticks import Tick

PROVED = replace(FIXED, proof=PROOF)
UNDISTURBED = run(SHORT, PROVED)
HOLDS = [s.voltage for s in SHORT if s.phase == "hold"]


def slew_kept(ran: Ran) -> bool:
    """Never faster than the slew, except to 0 V. While nothing is sent the command counts as unchanged."""
    commands, last = [], 0.0
    for output in ran.outputs:
        commands.append((last, last if output.volts is None else output.volts))
        last = commands[-1][1]
    return all(b == 0.0 or abs(b - a) <= SLEW * PERIOD + 1e-6 for a, b in commands)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, len(UNDISTURBED.outputs) - 30), st.sampled_from(["trip", "stop", "both"]))
def test_every_trip_and_stop_ends_at_zero_at_once_and_stays(number, how):
    more = {"trip": TRIP} if how != "stop" else {}
    ran = run(SHORT, PROVED, at={number: more | (asks("stop") if how != "trip" else {})})
    assert all(output.volts == 0.0 for output in ran.outputs[number:])
    assert ran.last.done
    assert ran.last.stop_confirmed is True
    assert ran.last.outcome == ("aborted" if how == "stop" else "tripped")
    assert ran.last.cause == ("stopped by the operator" if how == "stop" else TRIP.cause)
    assert ran.outputs[number].outcome == ran.last.outcome


KINDS = st.sampled_from(["pause", "resume", "accept", "extend", "repeat", "note"])


@settings(max_examples=40, deadline=None)
@given(st.dictionaries(st.integers(0, 1500), st.lists(KINDS, min_size=1, max_size=3), max_size=12), st.booleans())
def test_every_interleaving_ends_with_all_steps_done_or_stopped(requests, stop):
    at = {number: asks(*kinds) for number, kinds in requests.items()}
    at |= {number: asks("resume") for number in range(1501, 1510)}
    if stop:
        at[1400] = asks("stop")
    ran = run(SHORT, PROVED, at=at, ticks=8000)
    assert ran.last.done
    assert slew_kept(ran)
    whole = [r.command_voltage for r in ran.rows if r.phase == "hold"]
    if ran.last.outcome == "completed":
        assert whole == HOLDS
    else:
        assert ran.last.outcome == "aborted"
        assert whole == HOLDS[: len(whole)]
    paused = [o.volts for o in ran.outputs if o.state == "paused"]
    assert set(paused) <= {0.0}


@pytest.mark.parametrize("state", ["proving", "tare", "ramp", "hold", "rest"])
def test_pause_in_every_state_retakes_the_step(state):
    number = in_state(UNDISTURBED, state)
    ran = run(SHORT, PROVED, at={number: asks("pause"), number + 50: asks("resume")})
    assert ran.outputs[number].state == "paused"
    assert ran.outputs[number].volts == 0.0
    assert [p.voltage for p in ran.points] == HOLDS
    assert ran.last.outcome == "completed"
    assert slew_kept(ran)


def test_hold_cut_by_a_pause_is_free_and_the_wait_is_rest():
    number = in_state(UNDISTURBED, "hold")
    ran = run(SHORT, PROVED, at={number: asks("pause"), number + 50: asks("resume")})
    index = next(o.step for o in UNDISTURBED.outputs if o.state == "hold")
    assert [r.phase for r in ran.rows if r.index == index] == ["free", "rest", "ramp", "hold"]


@pytest.mark.parametrize(
    ("plan", "state"),
    [(Plan(Sine(5.0, (0.2,), 1), FixedDwell(1.0), slew=SLEW, tare=TareConfig(1.0)), "sine"),
     (Plan(Ramp(6.0, 2.0), FixedDwell(1.0), slew=SLEW, tare=TareConfig(1.0)), "ramp")],
)  # fmt: skip
def test_sine_and_sweep_are_retaken_from_their_start(plan, state):
    number = in_state(run(plan, FIXED), state, skip=200)
    ran = run(plan, FIXED, at={number: asks("pause"), number + 50: asks("resume")})
    assert ran.last.outcome == "completed"
    after = [o for o in ran.outputs[number + 50 :] if o.state == state]
    if state == "sine":
        assert len(after) * PERIOD == pytest.approx(5.0, abs=3 * PERIOD)
    else:  # 4 s into the sweep: from +6 V on the way to -6 V, so +6 V is approached anew
        assert max(o.volts for o in after) == 6.0
    assert slew_kept(ran)


def test_accept_ends_a_hold_now_and_keeps_its_data():
    number = in_state(UNDISTURBED, "hold", skip=40)
    ran = run(SHORT, PROVED, at={number: asks("accept")})
    assert ran.points[0].duration < 0.9
    assert [p.voltage for p in ran.points] == HOLDS
    assert ran.said("ended early")


def test_skip_means_nothing_elsewhere_and_says_so():
    ran = run(SHORT, FIXED, at={3: asks("skip"), 4: asks("resume")})
    assert ran.said("skip ignored: it means nothing in state tare")
    assert ran.said("resume ignored")


def test_lapse_of_the_loop_trips_and_commands_zero():
    sequencer, world = Sequencer(SHORT, FIXED), World()
    while (output := sequencer.advance(world.tick())).state != "hold":
        world.step(output.volts)
    output = sequencer.advance(Tick(world.time + 0.5, (), world.rotation))
    assert output.volts == 0.0
    assert output.outcome == "tripped"
    assert "no tick for 0.50 s" in output.cause


def test_lapse_while_paused_is_no_reason_to_end():
    sequencer = Sequencer(SHORT, FIXED)
    sequencer.advance(Tick(0.0, (), 0.0))
    sequencer.advance(Tick(0.02, (), 0.0, requests=(Request("pause"),)))
    assert sequencer.advance(Tick(5.0, (), 0.0)).state == "paused"
    assert sequencer.advance(Tick(5.02, (), 0.0, trip=TRIP)).outcome == "tripped"


def test_stop_that_is_ignored_is_released_and_not_confirmed():
    number = in_state(UNDISTURBED, "hold")
    world = World()
    sequencer, outputs = Sequencer(SHORT, PROVED), []
    for i in range(number + 300):
        world.runs_away = i >= number
        outputs.append(sequencer.advance(world.tick(**(asks("stop") if i == number else {}))))
        world.step(outputs[-1].volts)
    assert outputs[-1].done
    assert outputs[-1].stop_confirmed is False
    assert outputs[number + 10].release is False
    assert outputs[number + 80].release is True  # half the coast time of 3 s is over
    assert any("STOP NOT CONFIRMED" in e.text for o in outputs for e in o.events)
    assert {o.volts for o in outputs[number:]} == {0.0}


def test_unknown_rotation_confirms_nothing():
    ran = run(SHORT, FIXED, World(blind=True), at={100: {"requests": (Request("stop", "SIGTERM"),)}})
    assert ran.last.stop_confirmed is False
    assert ran.last.cause == "stopped by SIGTERM"
    assert ran.said("the rotation rate is unknown")


def test_trip_while_stopping_is_told_once_and_changes_nothing():
    at = {100: asks("stop")} | {i: {"trip": TRIP} for i in range(103, 107)}
    ran = run(SHORT, FIXED, at=at)
    assert ran.last.outcome == "aborted"
    assert [e.text for e in ran.events].count(f"while stopping: {TRIP.cause}") == 1


def test_after_the_end_nothing_moves_any_more():
    sequencer, world = Sequencer(SHORT, FIXED), World()
    while not (output := sequencer.advance(world.tick())).done:
        world.step(output.volts)
    for kind in ("resume", "skip", "accept", "repeat", "back", "extend", "bad", "pause", "stop"):
        world.step(0.0)
        output = sequencer.advance(world.tick(**asks(kind), trip=TRIP))
        assert (output.volts, output.state, output.outcome, output.events) == (0.0, "run_done", "completed", ())


ANY = st.sampled_from(["pause", "resume", "accept", "skip", "repeat", "back", "extend", "bad"])


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.integers(0, 1500), st.lists(ANY, min_size=1, max_size=3), max_size=12))
def test_whatever_is_asked_the_slew_is_kept_and_a_step_is_measured_or_given_up(requests):
    at = {number: asks(*kinds) for number, kinds in requests.items()}
    at |= {number: asks("resume") for number in range(1501, 1510)}
    ran = run(SHORT, PROVED, at=at, ticks=12000)
    assert ran.last.done
    assert ran.last.outcome == "completed"
    assert slew_kept(ran)
    given_up = {index for output in ran.outputs for index in output.given_up}
    measured = {row.index for row in ran.rows if row.phase == "hold"}
    assert {step.index for step in SHORT if step.phase == "hold"} <= measured | given_up


def test_a_step_that_is_skipped_gives_no_point_and_its_row_is_free():
    number = in_state(UNDISTURBED, "hold", skip=40)
    index = UNDISTURBED.outputs[number].step
    ran = run(SHORT, PROVED, at={number: asks("skip")})
    assert [p.voltage for p in ran.points] == HOLDS[1:]
    assert [row.phase for row in ran.rows if row.index == index and row.phase != "ramp"] == ["free"]
    assert ran.outputs[number].given_up == (index,)
    assert ran.said(f"step {index + 1} is left out on request")


def test_a_step_that_is_taken_again_lasts_its_whole_time():
    number = in_state(UNDISTURBED, "hold", skip=40)
    index = UNDISTURBED.outputs[number].step
    ran = run(SHORT, PROVED, at={number: asks("repeat")})
    assert [p.voltage for p in ran.points] == HOLDS
    assert [row.phase for row in ran.rows if row.index == index and row.phase != "ramp"] == ["free", "hold"]
    assert ran.points[0].duration == pytest.approx(UNDISTURBED.points[0].duration, abs=PERIOD)


def test_back_measures_the_step_before_once_more_and_goes_on():
    steps = [row.index for row in UNDISTURBED.rows if row.phase == "hold"]
    number = next(i for i, o in enumerate(UNDISTURBED.outputs) if o.state == "hold" and o.step == steps[1])
    ran = run(SHORT, PROVED, at={number + 20: asks("back")})
    assert [row.index for row in ran.rows if row.phase == "hold"] == [steps[0], *steps]
    assert ran.last.outcome == "completed"
    assert slew_kept(ran)


def test_back_before_anything_is_measured_is_refused():
    number = in_state(UNDISTURBED, "hold", skip=20)
    ran = run(SHORT, PROVED, at={number: asks("back")})
    assert ran.said("back ignored: nothing was measured before step")
    assert [p.voltage for p in ran.points] == HOLDS


def test_a_hold_that_is_extended_lasts_twice_as_long():
    plain = run(SHORT, FIXED)
    ran = run(SHORT, FIXED, at={in_state(plain, "hold", skip=20): asks("extend")})
    assert ran.points[0].duration == pytest.approx(2 * plain.points[0].duration, abs=2 * PERIOD)
    assert ran.points[1].duration == pytest.approx(plain.points[1].duration, abs=2 * PERIOD)


def test_what_was_measured_last_is_marked_by_a_row_of_its_own():
    steps = [row for row in UNDISTURBED.rows if row.phase == "hold"]
    number = next(i for i, o in enumerate(UNDISTURBED.outputs) if o.state == "hold" and o.step == steps[1].index)
    ran = run(SHORT, PROVED, at={number + 5: asks("bad"), number + 6: asks("bad")})
    (void,) = [row for row in ran.rows if row.phase == "void"]
    (hold, *_) = [row for row in ran.rows if row.phase == "hold"]
    assert (void.index, void.t_start, void.t_end) == (hold.index, hold.t_start, hold.t_end)
    assert ran.outputs[number + 5].given_up == (hold.index,)
    assert ran.said("marked bad by the operator: step")
    assert ran.said("bad ignored: no step was measured to its end")
    assert ran.last.outcome == "completed"


def test_what_means_nothing_before_the_first_hold_says_so():
    ran = run(SHORT, FIXED, at={3: asks("accept", "extend", "back", "bad")})
    for kind in ("accept", "extend", "back", "bad"):
        assert ran.said(f"{kind} ignored")


def test_a_mark_after_a_sweep_never_falls_on_the_hold_before_it():
    journal = Journal()
    hold = Step(1, "hold", 4.0, 1.0, 1.0)
    sweep = Step(2, "ramp", -4.0, 2.0, 2.0, from_voltage=4.0, swept=True)
    journal.row("hold", hold, 4.0, 0.0, 1.0)
    journal.row("ramp", sweep, -4.0, 1.0, 3.0)
    assert journal.void_last() is None
    assert [row.phase for row in journal.rows] == ["hold", "ramp"]


@pytest.mark.parametrize(("how", "level"), [({"trip": TRIP}, "trip"), (asks("stop"), "warning")])
def test_a_trip_is_told_as_one_and_a_stop_is_not(how, level):
    ran = run(SHORT, FIXED, at={100: how})
    (event,) = [event for event in ran.events if event.text.endswith(": command 0 V")]
    assert event.level == level


def test_without_a_tare_a_point_is_what_the_cell_reads():
    tared = run(SHORT, FIXED, World(offset=0.7))
    bare = run([step for step in SHORT if step.phase != "tare"], FIXED, World(offset=0.7))
    for with_tare, without in zip(tared.points, bare.points, strict=True):
        assert without.thrust == pytest.approx(with_tare.thrust + 0.7, abs=0.1)
