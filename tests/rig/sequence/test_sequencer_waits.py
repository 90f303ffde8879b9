"""Waits at 0 V: for water, for a motor that cools; and what ends, breaks off or fails one."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_sequencer import FIXED, PERIOD, PROOF, TRIP, asks, run

from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import TARE_AGAIN, Plan, TareConfig
from rig.campaign.shapes import Levels
from rig.campaign.waits import CoolDown
from rig.errors import PlanError

WATER = 5.0
COOL = CoolDown("motor.motor_temperature", 50.0, 20.0)


def plan(**more) -> Plan:
    return Plan(Levels((3.0, -3.0)), FixedDwell(1.0, 0.2), 12.0, tare=TareConfig(1.0), rest=0.5, **more)


def waits(ran) -> list[float]:
    """Seconds of each."""
    numbers, found = [], []
    for number, output in enumerate(ran.outputs):
        if output.state == "wait":
            if not numbers or numbers[-1] != number - 1:
                found.append(0)
            numbers.append(number)
            found[-1] += 1
    return [round(count * PERIOD, 1) for count in found]


def texts(ran) -> str:
    return "\n".join(line.text for line in ran.gathered("events"))


def temperatures(value_at) -> dict:
    """Of every tick; None: nothing fresh, which is what a NaN or stale value comes to."""
    return {n: {"temperature": value_at(n * PERIOD)} for n in range(20_000)}


def test_water_settles_before_each_tare_at_zero_volts_and_is_recorded_as_rest():
    ran = run(plan(settle_water=WATER), FIXED)
    assert waits(ran) == [WATER, WATER]
    assert {o.volts for o in ran.outputs if o.state == "wait"} == {0.0}
    assert [r.phase for r in ran.rows if r.phase in ("tare", "rest")] == ["rest", "tare", *["rest"] * 2, "tare", "rest"]
    assert ran.last.outcome == "completed"
    assert "water settles: 4 s left" in {o.reason for o in ran.outputs}
    assert "waits at 0 V: 5 s for the water to settle" in texts(ran)


def test_water_settles_where_the_direction_changes():
    steps = [s.doing for s in plan(settle_reversal=WATER)]
    assert steps == ["tare", "ramp", "hold", "ramp", "wait", "ramp", "hold", "ramp", "rest", "tare"]
    zero_between = replace(plan(settle_reversal=WATER), shape=Levels((3.0, 0.0, -3.0)))
    assert [s.doing for s in zero_between].count("wait") == 1
    one_way = replace(plan(settle_reversal=WATER), shape=Levels((3.0, 0.0, 4.0)))
    assert [s.doing for s in one_way].count("wait") == 0
    returned = replace(plan(settle_reversal=WATER), zero_every=1)
    assert [s.doing for s in returned].count("wait") == 0
    assert waits(run(plan(settle_reversal=WATER), FIXED)) == [WATER]


def test_the_proof_of_each_rest_stands_before_the_propellers_rest_and_not_before_a_wait():
    ran = run(plan(settle_water=WATER), replace(FIXED, proof=PROOF))
    order = [a.state for a, b in zip(ran.outputs, [*ran.outputs[1:], ran.last], strict=True) if a.state != b.state]
    assert order[:3] == ["proving", "wait", "tare"]
    assert order[-6:] == ["ramp", "proving", "rest", "wait", "tare", "stopping"]


def test_the_time_left_and_the_durations_count_the_wait():
    without, with_ = plan().duration(), plan(settle_water=WATER, cool_down=COOL).duration()
    assert with_.expected == pytest.approx(without.expected + 2 * WATER)
    assert with_.worst == pytest.approx(without.worst + COOL.longest + WATER)
    ran = run(plan(settle_water=WATER), FIXED)
    assert ran.outputs[0].remaining == pytest.approx(without.expected + 2 * WATER, abs=0.1)
    in_wait = ran.outputs[round(2.0 / PERIOD)]
    assert in_wait.remaining == pytest.approx(without.expected + 2 * WATER - 2.0, abs=0.1)
    assert in_wait.state_elapsed == pytest.approx(2.0, abs=0.05)


def test_a_motor_is_waited_for_until_it_was_cool_for_a_second():
    ran = run(plan(cool_down=COOL), FIXED, at=temperatures(lambda t: 60.0 - t))
    (seconds,) = waits(ran)
    assert seconds == pytest.approx(11.0, abs=0.1)
    assert ran.last.outcome == "completed"
    assert "motor temperature 60.0 °C, goes on below 50 °C, at most 20 s more" in {o.reason for o in ran.outputs}
    assert "waited 11.0 s: motor temperature 49.0 °C" in texts(ran)


def test_a_single_low_value_or_a_gap_is_not_cool():
    def glitches(t):
        return None if 5.0 < t < 5.1 else 20.0 if t > 4.5 else 60.0

    (seconds,) = waits(run(plan(cool_down=COOL), FIXED, at=temperatures(glitches)))
    assert seconds == pytest.approx(6.1, abs=0.1)


def test_water_and_motor_are_waited_for_together():
    ran = run(plan(cool_down=COOL, settle_water=WATER), FIXED, at=temperatures(lambda t: 53.0 - t))
    assert waits(ran) == [WATER, WATER]
    assert any("water settles: 4 s left; motor temperature" in o.reason for o in ran.outputs)


@pytest.mark.parametrize("value", [None, 61.2], ids=["unknown", "never cool"])
def test_what_does_not_cool_down_ends_the_run_at_zero_volts(value):
    ran = run(plan(cool_down=COOL), FIXED, at=temperatures(lambda t: value))
    assert waits(ran) == [COOL.longest]
    assert ran.last.outcome == "tripped"
    said = "unknown" if value is None else "61.2 °C"
    assert ran.last.cause == (
        f"not cooled down: motor temperature {said} after 20 s at 0 V, and below 50 °C was waited for"
    )
    assert {o.volts for o in ran.outputs} == {0.0}


def test_an_operator_who_is_asked_waits_once_more_or_goes_on():
    asking = plan(cool_down=replace(COOL, otherwise="ask"))
    first = round(COOL.longest / PERIOD)
    at = temperatures(lambda t: 61.2)
    at[first + 50] |= asks("resume")
    at[first + 150] |= asks("skip")
    ran = run(asking, FIXED, at=at)
    paused = [o for o in ran.outputs if o.state == "paused"]
    assert paused[0].reason.startswith("not cooled down: motor temperature 61.2 °C")
    assert {o.volts for o in paused} == {0.0}
    assert ran.last.outcome == "completed"
    assert "broken off on request: motor temperature 61.2 °C" in texts(ran)


def test_nobody_is_asked_where_nobody_is():
    asking = plan(cool_down=replace(COOL, otherwise="ask"))
    ran = run(asking, replace(FIXED, attended=False), at=temperatures(lambda t: 61.2))
    assert ran.last.outcome == "tripped"


def test_a_wait_that_is_skipped_costs_no_data():
    ran = run(plan(settle_water=WATER), FIXED, at={50: asks("skip")})
    assert waits(ran) == [1.0, WATER]
    assert ran.last.outcome == "completed"
    assert ran.gathered("given_up") == []
    assert "the wait of step 1 is broken off on request: water settles: 4 s left" in texts(ran)


def test_a_pause_in_a_wait_takes_it_again_and_is_left_out_of_the_time_left():
    ran = run(plan(settle_water=WATER), FIXED, at={100: asks("pause"), 200: asks("resume")})
    assert waits(ran) == [2.0, WATER, WATER]
    paused = ran.outputs[150]
    assert (paused.state, paused.reason, paused.step_elapsed) == ("paused", "by the operator", 0.0)
    assert paused.state_elapsed == pytest.approx(1.0)
    assert ran.outputs[101].remaining == paused.remaining == pytest.approx(ran.outputs[0].remaining, abs=0.1)
    assert ran.outputs[190].paused_for == pytest.approx(1.8)
    assert ran.last.paused_for == pytest.approx(2.0)


@pytest.mark.parametrize(("how", "outcome"), [(asks("stop"), "aborted"), ({"trip": TRIP}, "tripped")])
def test_stop_and_trip_end_a_wait(how, outcome):
    ran = run(plan(settle_water=WATER), FIXED, at={100: how})
    assert ran.outputs[100].state == "stopping"
    assert (ran.last.outcome, ran.last.volts) == (outcome, 0.0)


KINDS = st.sampled_from(["pause", "resume", "skip", "back", "accept", "repeat", "bad"])
ASKED = st.dictionaries(st.integers(0, 2000), st.lists(KINDS, min_size=1, max_size=2), max_size=12)


@settings(max_examples=40, deadline=None)
@given(ASKED, st.sampled_from([None, 45.0, 61.0]), st.sampled_from(["end", "ask"]))
def test_whatever_is_asked_and_measured_the_command_of_a_wait_is_zero_and_the_run_ends_at_rest(asked, value, otherwise):
    wanted = plan(settle_water=2.0, settle_reversal=3.0, cool_down=replace(COOL, longest=4.0, otherwise=otherwise))
    at = temperatures(lambda t: value)
    for number, kinds in asked.items():
        at[number] |= asks(*kinds)
    for number in range(2001, 8000, 50):
        at[number] |= asks("resume")
        at[number + 25] |= asks("skip")
    ran = run(wanted, FIXED, at=at, ticks=10_000)
    assert ran.last.done
    assert ran.last.volts == 0.0
    assert {o.volts for o in ran.outputs if o.state in ("wait", "paused")} <= {0.0}
    assert all(o.reason for o in ran.outputs if o.state == "paused")
    assert all(o.remaining >= 0.0 for o in ran.outputs)
    assert all(r.command_voltage == 0.0 for r in ran.rows if r.phase == "rest")


def test_a_run_that_goes_on_waits_anew_before_its_tare():
    whole = plan(settle_water=WATER, settle_reversal=WATER, cool_down=COOL)
    steps = tuple(whole)
    reversal = next(s.index for s in steps if s.doing == "wait" and s.index > 1)
    left = whole.after(frozenset(range(reversal)))
    assert [(s.index, s.doing) for s in left[:3]] == [
        (TARE_AGAIN, "wait"), (TARE_AGAIN, "tare"), (reversal + 1, "ramp"),
    ]  # fmt: skip
    last = whole.after(frozenset(range(len(steps) - 1)))
    assert [(s.index, s.doing) for s in last] == [(TARE_AGAIN, "wait"), (len(steps) - 1, "tare")]
    assert whole.after(frozenset(range(len(steps)))) == ()
    assert run(left, FIXED, at=temperatures(lambda t: 20.0)).last.outcome == "completed"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"settle_water": -1.0}, "settle_water"),
        ({"settle_reversal": float("nan")}, "settle_reversal"),
    ],
)
def test_impossible_waits_are_refused(more, said):
    with pytest.raises(PlanError, match=said):
        plan(**more)


@pytest.mark.parametrize(("below", "longest"), [(float("nan"), 10.0), (50.0, 0.0), (50.0, float("inf"))])
def test_an_impossible_cool_down_is_refused(below, longest):
    with pytest.raises(PlanError, match="cool_down"):
        CoolDown("motor.motor_temperature", below, longest)
