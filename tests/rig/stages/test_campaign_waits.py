"""A campaign that waits at 0 V, in virtual time: what is recorded, told and left; and what ends a wait."""

from dataclasses import replace
from math import nan

import pytest

from rig.campaign.waits import CoolDown
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import StepRow
from tests.rig.stages.played import left_alone, outcome, play
from tests.rig.virtual_bench import PLAN, virtual
from tests.rig.virtual_devices import winding

COOL = CoolDown("winding.motor_temperature", 50.0, 8.0)
WAITS = replace(PLAN, settle_water=3.0)
COOLS = replace(PLAN, cool_down=COOL)


def never_driven_in_a_wait(seen) -> bool:
    return {s.command for s in seen if s.state == "wait"} == {0.0}


def test_the_wait_is_told_with_its_countdown_recorded_as_rest_and_in_the_time_left(tmp_path):
    with virtual(tmp_path, plan=WAITS) as world:
        seen = play(world)
        assert outcome(world) == ("completed", "")
        rows = [m for m in world.recorder.taken if isinstance(m, StepRow)]
    first = next(s for s in seen if s.state == "wait")
    assert first.reason == "water settles: 3 s left"
    assert first.progress.eta == pytest.approx(WAITS.duration().expected, abs=0.2)
    assert {"water settles: 1 s left"} < {s.reason for s in seen}
    assert all(s.reason == "" for s in seen if s.state not in ("wait", "paused"))
    assert never_driven_in_a_wait(seen)
    assert rows[0].phase == "rest"
    assert rows[0].t_end - rows[0].t_start == pytest.approx(3.0, abs=0.05)


def test_a_hot_motor_is_waited_for(tmp_path):
    thermometer = winding(61.2)
    with virtual(tmp_path, inputs=(thermometer,), plan=COOLS) as world:
        seen = play(world, [("wait", 0.0, lambda: world.clock.at.append((cooled(world), lambda: cool(thermometer))))])
        assert outcome(world) == ("completed", "")
        assert "waited 4.0 s: motor temperature 40.0 °C" in world.texts
    assert "motor temperature 61.2 °C, goes on below 50 °C, at most 7 s more" in {s.reason for s in seen}
    assert never_driven_in_a_wait(seen)


def cooled(world) -> float:
    return world.clock.t_ns * 1e-9 + 3.0


def cool(thermometer) -> None:
    """It says so at once: when its next row would be due depends on the tick in which the run began."""
    thermometer.value, thermometer.due = 40.0, 0.0


@pytest.mark.parametrize("value", [61.2, nan, None], ids=["never cools", "NaN", "stale"])
def test_what_is_not_known_to_be_cool_ends_the_run(tmp_path, value):
    thermometer = winding(20.0)

    def spoil():
        thermometer.value = value

    with virtual(tmp_path, inputs=(thermometer,), plan=COOLS) as world:
        seen = play(world, [("mount", 0.0, spoil)])
        assert outcome(world)[0] == "tripped"
        assert "not cooled down: motor temperature" in outcome(world)[1]
    assert not any(s.command for s in seen)


def test_the_guard_watches_in_a_wait(tmp_path):
    with virtual(tmp_path, plan=WAITS) as world:
        seen = play(world, [("wait", 0.0, lambda: setattr(world.cell, "spoil", lambda value: value + 1e3))])
        assert outcome(world)[0] == "tripped"
        assert "load_cell.thrust" in outcome(world)[1]
    assert not any(s.command for s in seen)


def test_an_operator_who_leaves_in_a_wait_ends_an_attended_run(tmp_path):
    with virtual(tmp_path, plan=WAITS, unattended=False) as world:
        left_alone(world, lambda: world.session.status.state == "wait")
        assert outcome(world)[0] == "tripped"
        assert "the operator is gone" in outcome(world)[1]
        assert not any(volts for _, volts in world.motor.sent)


def test_a_stop_in_a_wait_ends_the_run(tmp_path):
    with virtual(tmp_path, plan=WAITS) as world:
        play(world, [("wait", 0.0, lambda: world.session.loop.signals.append(Request("stop", "a test")))])
        assert outcome(world) == ("aborted", "stopped by a test")


def test_a_pause_before_a_run_means_nothing_and_says_so(tmp_path):
    with virtual(tmp_path, mount=()) as world:

        def ask():
            world.session.loop.signals.extend([Request("pause"), Request("mounted")])

        assert world.session.status.state == "connecting"
        seen = play(world, [("preflight", 0.0, lambda: world.session.loop.signals.append(Request("pause"))),
                            ("mount", 0.0, ask)])  # fmt: skip
        assert outcome(world) == ("completed", "")
        for state in ("preflight", "mount"):
            said = f"pause ignored: in state {state} no step is under way, and the command is 0 V"
            assert said in world.texts
    assert "paused" not in {s.state for s in seen}


def test_progress_and_time_left_leave_a_pause_out(tmp_path):
    with virtual(tmp_path) as world:

        def pause():
            world.session.loop.signals.append(Request("pause"))
            again = world.clock.t_ns * 1e-9 + 30.0
            world.clock.at.append((again, lambda: world.session.loop.signals.append(Request("resume"))))

        seen = play(world, [("hold", 6.0, pause)])
        assert outcome(world) == ("completed", "")
        assert world.session.status.paused_for == pytest.approx(30.0, abs=0.1)
    paused = [s for s in seen if s.state == "paused"]
    assert {s.reason for s in paused} == {"by the operator"}
    assert paused[-1].state_elapsed == pytest.approx(30.0, abs=0.2)
    assert paused[-1].progress.elapsed == pytest.approx(paused[0].progress.elapsed, abs=0.01)
    assert paused[-1].progress.eta == paused[0].progress.eta
    assert paused[-1].progress.fraction == pytest.approx(paused[0].progress.fraction, abs=0.001)
    assert next(s for s in reversed(seen) if s.progress).progress.elapsed < 20.0
