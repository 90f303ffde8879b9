"""The control loop where little decides: before its first tick, at its limits, and what it hands to whom."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drivers.errors import LinkError
from drivers.protocols import Sample
from rig.campaign.bench import COMMAND_STREAM
from rig.campaign.config import LimitConfig
from rig.control.loop import IDLE, Decision, Inputs
from rig.control.motor_watch import RestByThrust
from rig.link.front_end_messages import Request
from rig.link.recorder_messages import Rows
from rig.safety import guard
from rig.safety.lost_time import HostClocks
from tests.rig.control.test_loop import driven
from tests.rig.virtual_bench import virtual


def test_before_the_first_tick_nothing_was_driven_and_nothing_is_late(tmp_path):
    with virtual(tmp_path) as world:
        loop = world.session.loop
        assert (loop.command, loop.has_driven, loop.driven_since, loop.lateness) == (0.0, False, None, 0.0)
        loop.tick(world.motor, lambda _: IDLE)
        assert (loop.lateness, loop.late.worst, loop.has_driven) == (0.0, 0.0, False)


def test_rotation_is_guarded_though_nothing_limits_it(tmp_path):
    with virtual(tmp_path) as world:
        loop = world.session.loop
        assert loop.rotation_channel == "motor.rotation_rate"
        assert {"load_cell.thrust", "motor.rotation_rate"} <= {one.channel for one in loop.guarded_channels}


def test_a_thrust_that_counts_as_none_is_that_of_the_bench_file_from_the_beginning(tmp_path, monkeypatch):
    names = {"rotation_rate": "speed"}

    def without_a_rate(self):
        (stream,) = streams.fget(self)
        channels = tuple(replace(c, quantity=None, name=names.get(c.name, c.name)) if c.name in names else c
                         for c in stream.channels)  # fmt: skip
        return (replace(stream, channels=channels),)

    with virtual(tmp_path) as world:
        streams = type(world.motor).streams
        monkeypatch.setattr(type(world.motor), "streams", property(without_a_rate))
        bench = replace(
            world.session.bench, config=replace(world.session.bench.config, rest_thrust=1.5, rest_current=2.5)
        )
        loop = replace(world.session.loop, bench=bench)
        assert loop.rotation_channel is None
        assert loop.thrust_rest.within == 1.5


@pytest.mark.parametrize(("held_up", "sent"), [(0.235, [6.0]), (0.26, [0.0])])
def test_a_set_point_may_be_as_old_as_the_lateness_and_one_period(tmp_path, held_up, sent):
    """0.25 s and 20 ms; the one before it went 20 ms before this tick began."""
    with driven(tmp_path) as (world, _, __):
        before = len(world.motor.sent)

        def decide(_: Inputs) -> Decision:
            world.clock.stall(held_up)
            return Decision(6.0)

        world.session.loop.tick(world.motor, decide)
        assert [volts for _, volts in world.motor.sent[before:]] == sent


def test_a_motor_that_does_not_follow_is_seen_in_a_run(tmp_path):
    with driven(tmp_path) as (world, turn, trips):
        world.session.recorder.streams = ("load_cell", "motor", "command")
        world.session.loop.begin_recording(world.clock.now_ns())
        world.motor.ignores, world.motor.volts = True, 0.0
        turn(10.0)
        assert trips


def test_what_pushes_is_known_from_the_tare(tmp_path):
    pushed = []
    with virtual(tmp_path) as world:
        loop = world.session.loop

        def decide(inputs: Inputs) -> Decision:
            pushed.append((inputs.push, inputs.thrust_rest))
            return Decision(6.0)

        for _ in range(20):
            loop.tick(world.motor, lambda _: IDLE)
        loop.thrust_rest.tared(0.7)
        for _ in range(50):
            loop.tick(world.motor, decide)
    push, rests = pushed[-1]
    assert push == pytest.approx(0.4 * 36.0, abs=1.0)
    assert rests is False


def test_a_stop_is_told_in_the_tick_in_which_it_comes(tmp_path):
    with driven(tmp_path) as (world, turn, _):
        loop, told = world.session.loop, []
        turn(0.2)
        loop.publish = told.append
        loop.tick(world.motor, lambda _: IDLE)
        told.clear()
        loop.signals.append(Request("stop", "a key"))
        loop.tick(world.motor, lambda _: IDLE)
        assert len(told) == 1


def test_a_current_just_below_its_limit_goes_on_and_just_above_ends(tmp_path):
    with driven(tmp_path) as (world, turn, trips):
        assert LimitConfig("motor.current", max=30.0) in world.session.loop.bench.config.limits
        world.motor.extra_current = 17.9
        turn(1.0)
        assert not trips, "12 A and 17.9 A are below 30 A"
        world.motor.extra_current = 18.1
        turn(1.0)
        assert trips[0][1] == "limit"


@pytest.mark.parametrize("motor", [True, False], ids=["silent on purpose", "no motor yet"])
def test_what_was_not_sent_is_stamped_with_its_tick(tmp_path, motor):
    with driven(tmp_path) as (world, _, __):
        session, loop = world.session, world.session.loop
        session.recorder.streams = ("load_cell", "motor", "command")
        loop.begin_recording(world.clock.now_ns())

        def nothing(_: Inputs) -> Decision:
            world.clock.stall(0.010)
            return Decision(None if motor else 3.0)

        began = world.clock.now_ns()
        loop.tick(session.motor if motor else None, nothing)
        world.recorder.step(0.0)
        (row,) = [r for r in world.recorder.of(Rows) if r.stream == 2]
        assert row.t_ns[0] == began


@pytest.mark.parametrize("unattended", [True, False])
def test_an_operator_who_is_gone_ends_it_where_one_is_needed(tmp_path, unattended):
    with virtual(tmp_path, unattended=unattended) as world:
        loop, trips = world.session.loop, []
        front = world.front()

        def decide(inputs: Inputs) -> Decision:
            if inputs.trip:
                trips.append(inputs.trip)
            return Decision(0.0 if trips else 6.0)

        def turn(ticks: int) -> None:
            for _ in range(ticks):
                front.send(Request("lease"))
                loop.tick(world.motor, decide)

        turn(20)
        loop.begin_guarding()
        turn(20)
        assert not trips
        front.close()
        for _ in range(3):
            loop.tick(world.motor, decide)
    assert bool(trips) is not unattended
    if trips:
        assert trips[0].source == "lease"
        assert "the last front end has closed its connection" in trips[0].cause


def test_rows_of_the_force_device_are_s_since_an_instant(tmp_path):
    with virtual(tmp_path) as world:
        samples = (
            Sample("load_cell", 900_000_000, (1.0,)), Sample("load_cell", 1_000_000_000, (2.0,)),
            Sample("motor", 1_100_000_000, (3.0, 4.0)), Sample("load_cell", 1_250_000_000, (5.0,)),
        )  # fmt: skip
        rows = world.session.loop.thrust_rows(samples, 1_000_000_000)
        assert rows == ((0.0, 2.0), (pytest.approx(0.25), 5.0))


@pytest.mark.parametrize(("allowed", "rests"), [(11.9, False), (12.0, True), (12.1, True)])
def test_current_is_a_witness_of_rest_where_there_is_no_rate(tmp_path, allowed, rests):
    seen = []
    with driven(tmp_path) as (world, _, __):
        loop = world.session.loop
        loop.tick(world.motor, lambda inputs: (seen.append(inputs.current_rest), Decision(6.0))[1])
        loop.rest_by_thrust = RestByThrust(1.0, "motor.current", allowed)
        loop.tick(world.motor, lambda inputs: (seen.append(inputs.current_rest), Decision(6.0))[1])
        world.motor.silent = True
        world.clock.stall(0.24)
        loop.tick(world.motor, lambda inputs: (seen.append(inputs.current_rest), Decision(6.0))[1])
    assert seen == [None, rests, None], "12 A; not asked for, asked for, too old"


def test_what_a_wire_refused_is_told_until_it_is_opened_anew(tmp_path):
    with driven(tmp_path) as (world, turn, trips):
        takes = world.motor.command

        def refuses(volts: float) -> None:
            raise LinkError("its wire takes nothing")

        world.motor.command = refuses
        world.session.loop.busy = lambda: "this machine is busy"
        turn(0.1)
        world.motor.command = takes
        refused = "the motor did not take a command: its wire takes nothing; this machine is busy"
        assert trips[0][1:] == ("link", refused)
        trips.clear()
        world.session.loop.begin_link()
        turn(0.5)
        assert not trips


def test_what_a_controller_holds_is_recorded_and_not_what_it_was_given_before_its_time(tmp_path):
    with virtual(tmp_path) as world:
        loop, motor, rows = world.session.loop, world.session.bench.motor, []
        motor.holds = 0.0
        loop.begin_recording(loop.clock.now_ns())
        loop.recorder.rows = rows.extend
        for volts, held in [(0.0, 0.0), (1.0, 0.0), (2.0, 2.0), (3.0, 2.0), (3.0, 3.0), (3.0, 3.0), (None, 3.0)]:
            motor.holds = held
            loop.tick(motor, lambda inputs, volts=volts: Decision(volts))
        commanded = [row.values[0] for row in rows if row.stream == COMMAND_STREAM]
        assert commanded[:-1] == [0.0, 2.0, 3.0]
        assert np.isnan(commanded[-1])


def test_a_recording_begins_anew_and_ends(tmp_path):
    with driven(tmp_path) as (world, turn, _):
        loop = world.session.loop
        world.session.recorder.streams = ("load_cell", "motor", "command")
        world.clock.stall(0.1)
        turn(0.1)
        assert loop.late.worst > 0.05
        before, begun = loop.motor_watch.consistency, []
        before.begin_run = lambda: begun.append(True)
        loop.begin_recording(world.clock.now_ns())
        assert (loop.late.worst, begun) == (0.0, [True])
        turn(0.1)
        world.recorder.step(0.0)
        recorded = len(world.recorder.of(Rows))
        assert recorded
        loop.end_recording()
        turn(0.2)
        world.recorder.step(0.0)
        assert len(world.recorder.of(Rows)) == recorded


def test_a_clock_that_is_set_is_told_once_and_nothing_else_is(tmp_path):
    with virtual(tmp_path) as world:
        loop, told, utc = world.session.loop, [], [0]
        loop.host = lambda: HostClocks(0, utc[0])
        loop.tick(world.motor, lambda _: IDLE)
        utc[0] = 3_000_000_000
        loop.tick(world.motor, lambda _: IDLE)
        loop.notice = told.append
        loop.tick(world.motor, lambda _: IDLE)
        utc[0] = 5_000_000_000
        loop.tick(world.motor, lambda _: IDLE)
        loop.tick(world.motor, lambda _: IDLE)
    assert told == ["the clock of this machine was set by +2.000 s; no time here is by it"]


def test_a_rate_that_is_found_frozen_is_no_rate(tmp_path, monkeypatch):
    with driven(tmp_path) as (world, _, __):
        loop = world.session.loop
        assert loop.rotation(loop.now) is not None
        monkeypatch.setattr(type(loop.motor_watch), "believed", False)
        assert loop.rotation(loop.now) is None


@pytest.mark.parametrize("unattended", [True, False])
def test_the_guard_is_told_how_long_the_motor_is_driven_and_who_was_seen(tmp_path, monkeypatch, unattended):
    seen, check = [], guard.check

    def noted(channels, newest, vitals, allowed):
        seen.append(vitals)
        return check(channels, newest, vitals, allowed)

    with virtual(tmp_path, unattended=unattended) as world:
        loop, front = world.session.loop, world.front()
        monkeypatch.setattr(guard, "check", noted)
        front.send(Request("lease"))
        loop.tick(world.motor, lambda _: IDLE)
        loop.begin_guarding()
        loop.tick(world.motor, lambda _: IDLE)
        for _ in range(4):
            loop.tick(world.motor, lambda _: Decision(6.0))
        for _ in range(2):
            loop.tick(world.motor, lambda _: IDLE)
        front.close()
    assert [vitals.driven for vitals in seen] == pytest.approx([0.0, 0.0, 0.02, 0.04, 0.06, 0.08, 0.0], abs=1e-6)
    assert [vitals.lease_age is None for vitals in seen] == [unattended] * 7
    if not unattended:
        assert seen[-1].lease_age == pytest.approx(0.14, abs=0.025)


def test_a_watcher_gets_the_rows_of_a_recording_and_when_the_command_left_in_s(tmp_path):
    with driven(tmp_path) as (world, _, __):
        loop, told = world.session.loop, []
        world.session.recorder.streams = ("load_cell", "motor", "command")
        loop.watcher = SimpleNamespace(rows=lambda rows, sent: told.append((rows, sent)))
        loop.tick(world.motor, lambda _: Decision(6.0))
        assert told == [], "nothing is recorded"
        loop.begin_recording(world.clock.now_ns())
        began = loop.now
        loop.tick(world.motor, lambda _: Decision(5.0))
    ((rows, sent),) = told
    assert [row.values for row in rows if row.stream == "command"] == [(5.0,)]
    assert began <= sent <= began + 0.02


def test_a_row_of_the_very_instant_at_which_a_recording_begins_is_in_it(tmp_path):
    with driven(tmp_path) as (world, _, __):
        loop, t0_ns = world.session.loop, world.clock.now_ns()
        world.session.recorder.streams = ("load_cell", "motor", "command")
        loop.begin_recording(t0_ns)
        loop._record([Sample("load_cell", t0_ns - 1, (1.0,)), Sample("load_cell", t0_ns, (2.0,))], None, t0_ns)
        world.recorder.step(0.0)
        assert [row.values.tolist() for row in world.recorder.of(Rows) if row.stream == 0] == [[[2.0]]]


def test_paces_are_told_whether_the_tick_before_commanded_anything(tmp_path):
    with driven(tmp_path) as (world, _, __):
        loop, told = world.session.loop, []
        loop._paces = SimpleNamespace(advance=lambda _vitals, _samples, *, commanded: told.append(commanded))
        for volts in (6.0, None, 0.0):
            loop.tick(world.motor, lambda _, volts=volts: Decision(volts))
        loop.tick(world.motor, lambda _: IDLE)
    assert told == [True, True, False, True]


def test_a_motor_that_is_not_let_go_is_told(tmp_path):
    with driven(tmp_path) as (world, turn, trips):

        def refuses() -> None:
            raise LinkError("its wire takes no release")

        world.motor.release = refuses
        world.session.loop.zero(world.motor)
        turn(0.1)
        assert trips[0][1:] == ("link", "the motor did not take a command: its wire takes no release")


def test_after_a_lapse_nothing_but_0_leaves_whoever_decides(tmp_path):
    with virtual(tmp_path) as world:
        loop = world.session.loop
        loop.tick(world.motor, lambda _: Decision(6.0))
        loop.tick(world.motor, lambda _: (world.clock.stall(0.5), Decision(6.0))[1])
        before = len(world.motor.sent)
        for _ in range(3):
            loop.tick(world.motor, lambda _: Decision(6.0))
        assert [volts for _, volts in world.motor.sent[before - 1 :]] == [0.0] * 4
