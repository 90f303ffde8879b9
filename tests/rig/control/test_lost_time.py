"""Machine asleep, process stopped, clock set: no old set-point leaves, in virtual time and through the whole loop."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass

import pytest

from rig.control.clocks import MonotonicClock, host_clocks
from rig.control.loop import Decision, Inputs
from rig.link.front_end_messages import Request
from rig.safety.guard import allowances
from rig.safety.lost_time import HostClocks, LostTime
from rig.stages.session import Stopped
from tests.rig.stages.played import outcome, play
from tests.rig.virtual_bench import VirtualBench, virtual

SECOND = 10**9


@dataclass
class Machine:
    """The clocks beside the monotonic one, of a machine that can sleep and be set."""

    slept_ns: int = 0
    utc_ns: int = 0

    def sleep(self, seconds: float) -> None:
        """CLOCK_MONOTONIC stands still meanwhile."""
        self.slept_ns += round(seconds * SECOND)

    def __call__(self) -> HostClocks:
        return HostClocks(self.slept_ns, self.utc_ns)


@contextmanager
def sleepy(folder, **options):
    with virtual(folder, **options) as world:
        machine = Machine()
        world.session.loop.host = machine
        yield world, machine


def commands_after(world: VirtualBench, what) -> list[float]:
    """Does `what` once and returns the list that later commands are added to."""
    before = len(world.motor.sent)
    what()
    return world.motor.sent[before:]


@pytest.mark.parametrize("seconds", [0.5, 8.0, 30.0])
@pytest.mark.parametrize(("state", "volts"), [("hold", 6.0), ("hold", -6.0), ("ramp", 0.48), ("ramp", -0.24)])
def test_no_old_set_point_after_sleep(tmp_path, seconds, state, volts):
    """The monotonic clock stands still: every sample and the last tick look fresh."""
    with sleepy(tmp_path) as (world, machine):
        sent = world.motor.sent
        marks: list[int] = []

        def sleep() -> None:
            marks.append(len(sent))
            machine.sleep(seconds)

        play(world, [(state, volts, sleep)])
        assert outcome(world)[0] == "tripped"
        assert "slept" in outcome(world)[1]
        assert {command for _, command in sent[marks[0] :]} == {0.0}
        assert any("slept" in event.text for event in world.recorder.events)


def test_sleep_during_a_mount_or_a_pause_ends_the_campaign(tmp_path):
    for state in ("mount", "paused"):
        folder = tmp_path / state
        folder.mkdir()
        with sleepy(folder, mount=("sleep", "0.3")) as (world, machine):
            steps = [(state, 0.0, lambda machine=machine: machine.sleep(60.0))]
            if state == "paused":
                pause = Request("pause")
                steps.insert(0, ("hold", 6.0, lambda world=world, p=pause: world.session.loop.signals.append(p)))
            play(world, steps)
            assert outcome(world)[0] == "tripped"
            assert "slept for 60" in outcome(world)[1]


@contextmanager
def driving(folder, machine: Machine):
    """A loop that drives 6 V; yields (world, tick) where tick(held_up) holds the decision up, as SIGSTOP would."""
    with virtual(folder) as world:
        loop, session = world.session.loop, world.session
        loop.host = machine
        session.motor = session.bench.motor
        trips: list[str] = []

        def tick(held_up=lambda: None) -> None:
            def decide(inputs: Inputs) -> Decision:
                if inputs.trip:
                    trips.append(inputs.trip.cause)
                held_up()
                return Decision(0.0 if trips else 6.0)

            loop.tick(session.motor, decide)

        for _ in range(20):
            tick()
        loop.begin_guarding()
        for _ in range(50):
            tick()
        assert world.motor.sent[-1][1] == 6.0
        yield world, tick, trips


def test_set_point_that_got_old_between_decision_and_frame_does_not_leave(tmp_path):
    with driving(tmp_path, Machine()) as (world, tick, trips):
        assert [v for _, v in commands_after(world, lambda: tick(lambda: world.clock.stall(1.0)))] == [0.0]
        tick()
        assert "was not told anything for 1.02 s" in trips[0]


def test_sleep_between_decision_and_frame(tmp_path):
    machine = Machine()
    with driving(tmp_path, machine) as (world, tick, trips):
        assert [v for _, v in commands_after(world, lambda: tick(lambda: machine.sleep(8.0)))] == [0.0]
        tick()
        assert trips


def test_a_set_point_that_left_old_all_the_same_is_followed_by_zero(tmp_path):
    """Stopped in the write itself: nobody can look between. The next frame is 0, at once."""
    with driving(tmp_path, Machine()) as (world, tick, trips):
        write = world.motor.command

        def held_up(volts: float) -> None:
            if not trips and volts and not world.motor.silent:
                world.motor.silent = True
                world.clock.stall(1.0)
            write(volts)

        world.motor.command = held_up
        assert [v for _, v in commands_after(world, tick)] == [6.0, 0.0]
        tick()
        assert trips
        assert world.session.loop.command == 0.0


def test_a_motor_with_a_short_timeout_is_not_driven_again_after_it(tmp_path):
    """Late by 0.15 s is no lapse to the rig, but its motor has let go after 0.1 s."""
    with virtual(tmp_path) as world:
        assert world.session.loop.allowed.lateness == 0.25
    assert allowances(50.0, 0.1).lateness == pytest.approx(0.08)
    assert allowances(50.0, 0.01).lateness == pytest.approx(0.02)


def test_little_lateness_is_no_lapse(tmp_path):
    with driving(tmp_path, Machine()) as (world, tick, trips):
        for late in (0.01, 0.05, 0.1, 0.2):
            world.clock.stall(late)
            tick()
            tick()
            tick(lambda late=late: world.clock.stall(late))
            tick()
        assert not trips
        assert world.motor.sent[-1][1] == 6.0


def test_a_clock_that_is_set_is_an_event_and_no_reason_to_stop(tmp_path):
    with sleepy(tmp_path) as (world, machine):
        play(world, [("hold", 6.0, lambda: setattr(machine, "utc_ns", 3600 * SECOND))])
        assert outcome(world) == ("completed", "")
        told = [event for event in world.recorder.events if "was set by +3600.000 s" in event.text]
        assert len(told) == 1
        assert told[0].level == "warning"
        held = [step for step in world.recorder.steps if step.phase == "hold"]
        assert all(0.5 < step.t_end - step.t_start < 0.7 for step in held)


def test_slow_corrections_of_the_clock_are_none():
    lost = LostTime(0.3)
    for utc in range(0, SECOND, 90_000_000):
        lost.look(HostClocks(0, utc))
        assert lost.utc_step == 0.0


def test_this_machine_is_awake():
    first, second = host_clocks(), host_clocks()
    assert abs(second.slept_ns - first.slept_ns) < SECOND
    assert MonotonicClock().now_ns() > 0


def test_idle_ticks_end_a_campaign_too(tmp_path):
    with sleepy(tmp_path) as (world, machine):
        world.session.motor = world.session.bench.motor
        world.session.turn_for(0.5)
        world.session.loop.begin_guarding()
        world.session.turn()
        machine.sleep(2.0)
        with pytest.raises(Stopped, match="slept for 2"):
            world.session.turn()
