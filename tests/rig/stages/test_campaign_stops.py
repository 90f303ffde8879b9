"""A campaign is stopped, left alone or kept from beginning, in virtual time: the motor at rest each time."""

import sys

import pytest

from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Close, Open
from rig.stages.campaign import run
from tests.rig.stages.played import left_alone, outcome, play
from tests.rig.virtual_bench import VirtualBench, virtual
from tests.rig.virtual_devices import flow_meter, stop_input


def drive_after(world: VirtualBench, now: float) -> list[tuple[float, float]]:
    return [(t, volts) for t, volts in world.motor.sent if t > now and volts]


def test_front_end_gone_ends_an_attended_run_in_the_next_tick(tmp_path):
    with virtual(tmp_path, unattended=False) as world:
        left = left_alone(world, lambda: world.session.loop.command == 6.0)
        assert outcome(world)[0] == "tripped"
        assert "the operator is gone" in outcome(world)[1]
        assert drive_after(world, left + 0.021) == []


@pytest.mark.parametrize("later", [0.0, 0.02, 0.04, 0.06, 0.08])
def test_the_snapshot_of_0_volts_comes_in_the_tick_of_the_stop_whenever_the_last_one_was(tmp_path, later):
    with virtual(tmp_path) as world:
        asked: list[float] = []

        def stop():
            asked.append(world.clock.t_ns * 1e-9)
            world.session.loop.signals.append(Request("stop", "a test"))

        seen = play(world, [("hold", 6.0, lambda: world.clock.at.append((world.clock.t_ns * 1e-9 + later, stop)))])
        told = next(s for s in seen if s.state == "stopping")
        assert told.command == 0.0
        assert told.since_begin + world.session.status.begun - asked[0] < 0.041


def test_starting_is_a_lease_too(tmp_path):
    """A front end that starts an attended campaign and never leases: it lapses after 2 s."""
    with virtual(tmp_path, unattended=False) as world:
        front, asked = world.front(), []

        def tick(_):
            front.receive()
            if world.session.status.state == "preflight" and not asked:
                asked.append(front.send(Request("start")))

        world.clock.each = tick
        run(world.session)
        front.close()
        assert outcome(world)[0] == "tripped"
        assert "no operator was seen" in outcome(world)[1]


@pytest.mark.parametrize("state", ["tare", "ramp", "hold", "rest"])
def test_stop_request_in_any_state(tmp_path, state):
    with virtual(tmp_path) as world:
        volts = {"tare": 0.0, "ramp": 0.48, "hold": 6.0, "rest": 0.0}[state]
        asked = []

        def stop():
            asked.append(world.clock.t_ns * 1e-9)
            world.session.loop.signals.append(Request("stop", "SIGTERM"))

        play(world, [(state, volts, stop)])
        assert outcome(world) == ("aborted", "stopped by SIGTERM")
        assert drive_after(world, asked[0] + 0.021) == []
        assert world.session.status.stop_confirmed is True
        assert world.recorder.of(Close)[-1].outcome == "aborted"


@pytest.mark.parametrize("state", ["connecting", "preflight", "mount"])
def test_stop_request_outside_a_run(tmp_path, state):
    mount = (sys.executable, "-c", "import time; time.sleep(60)")
    with virtual(tmp_path, mount=mount) as world:
        play(world, [(state, 0.0, lambda: world.session.loop.signals.append(Request("stop", "a test")))])
        assert outcome(world) == ("aborted", "stopped by a test")
        assert not world.recorder.of(Open)


@pytest.mark.parametrize(("becomes", "cause"), [(1.0, "EMERGENCY STOP"), (None, "button.emergency_stop is stale")])
def test_emergency_stop_ends_the_run_at_once_and_no_other_begins_while_it_is_pressed(tmp_path, becomes, cause):
    """Promise 12: pressed, or its cable pulled."""
    button = stop_input()
    with virtual(tmp_path, inputs=(button,), thrusters=("T1", "T3")) as world:
        at = []

        def press():
            at.append(world.clock.now_ns() * 1e-9)
            button.value = becomes

        play(world, [("hold", 6.0, press)])
        assert outcome(world)[0] == "tripped"
        assert cause in outcome(world)[1]
        zero = next(t for t, volts in world.motor.sent if t > at[0] and volts == 0.0)
        assert zero - at[0] < (0.1 if becomes else 0.3)
        assert not [volts for t, volts in world.motor.sent if t > zero and volts]
        assert len(world.recorder.of(Open)) == 1


def test_a_pressed_emergency_stop_lets_nothing_begin(tmp_path):
    button = stop_input()
    button.value = 1.0
    with virtual(tmp_path, inputs=(button,)) as world:
        world.clock.at.append((10.0, lambda: world.session.loop.signals.append(Request("stop"))))
        play(world)
        assert not [volts for _, volts in world.motor.sent if volts]
        assert not world.recorder.of(Open)


def test_a_campaign_waits_for_the_water_that_it_is_meant_for(tmp_path):
    """It comes after 10 s; the check follows it."""
    meter, checks = flow_meter(0.02), []
    with virtual(tmp_path, inputs=(meter,), flow_speed=0.5) as world:

        def turn_on():
            checks.append({c.name: c for c in world.session.status.checks}["flow"])
            assert not world.recorder.of(Open)
            meter.value = 0.51

        world.clock.at.append((10.0, turn_on))
        play(world)
        assert checks[0].verdict == "waiting"
        assert checks[0].text.startswith("0.02 m/s measured; the campaign is meant for 0.5 m/s: set the water")
        assert outcome(world)[0] == "completed"
        assert "m/s measured; the campaign is meant for 0.5 m/s" in world.texts


def test_nothing_begins_in_water_that_the_campaign_is_not_meant_for(tmp_path):
    """Not when the operator asks for it, and after a minute it is a failure, at which a headless run gives up."""
    verdicts = []
    with virtual(tmp_path, inputs=(flow_meter(0.02),), flow_speed=0.5) as world:

        def look():
            verdicts.append({c.name: c for c in world.session.status.checks}["flow"].verdict)
            world.session.loop.signals.append(Request("start"))

        world.clock.at += [
            (30.0, look),
            (70.0, look),
            (71.0, lambda: world.session.loop.signals.append(Request("stop"))),
        ]
        play(world)
        assert verdicts == ["waiting", "failed"]
        assert world.texts.count("not started: flow: 0.02 m/s measured") == 2
        assert not world.recorder.of(Open)


def test_stop_while_the_recorder_opens_and_while_it_closes_is_not_lost(tmp_path):
    with virtual(tmp_path) as world:
        world.clock.each = None
        opened = []

        def each(_):
            if world.session.recorder.streams and not opened:
                opened.append(1)
                world.session.loop.signals.append(Request("stop", "in between"))

        play(world, each=each)
        assert outcome(world) == ("aborted", "stopped by in between")
        assert not [volts for _, volts in world.motor.sent if volts]
