"""What the motor says is not believed alone: campaigns in virtual time, judged by what the propeller really did."""

import pytest

from rig.campaign.dwell import FixedDwell
from rig.campaign.plan import Plan
from rig.link.front_end_messages import Request
from tests.rig.stages.lies.lying_motor import Telemetry
from tests.rig.stages.played import outcome, play
from tests.rig.virtual_bench import PLAN, VirtualBench, virtual

LONG = Plan(PLAN.shape, FixedDwell(20.0, 0.2), slew=24.0, rest=0.3, tare=PLAN.tare)


def zero_after(world: VirtualBench, since: float) -> float:
    """s from `since` to the first command of the zeros that end the run."""
    last = max(time for time, volts in world.motor.sent if volts)
    return next(time for time, _ in world.motor.sent if time > last) - since


def when(world: VirtualBench, *does) -> tuple[list[float], object]:
    """A time stamp to be filled, and what does all of it."""
    at: list[float] = []

    def do() -> None:
        at.append(world.clock.t_ns * 1e-9)
        for one in does:
            one()

    return at, do


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_sound_motor_completes(tmp_path, noise):
    with virtual(tmp_path, plan=LONG, prove_watchdog=True) as world:
        Telemetry(world, noise)
        play(world)
        assert outcome(world) == ("completed", "")
        assert "and the thrust is back at its tare" in world.texts


def test_telemetry_that_freezes_in_a_hold_is_noise_that_vanished(tmp_path):
    with virtual(tmp_path, plan=LONG) as world:
        lying = Telemetry(world)
        at, freeze = when(world, lying.freeze)
        play(world, [("hold", -6.0, freeze)])
        assert outcome(world)[0] == "tripped"
        assert "the telemetry of motor is frozen: not one value has changed for" in outcome(world)[1]
        assert zero_after(world, at[0]) <= 1.0 + 0.1
        assert world.session.status.stop_confirmed is False, "nobody knows whether it turns"
        assert "the rotation rate is unknown" in world.texts


@pytest.mark.parametrize("noise", [0.0, 0.005])
@pytest.mark.parametrize(("state", "volts"), [("ramp", 2.4), ("ramp", -0.24)])
def test_telemetry_that_freezes_in_a_ramp_does_not_show_what_the_command_does(tmp_path, noise, state, volts):
    with virtual(tmp_path) as world:
        lying = Telemetry(world, noise)
        at, freeze = when(world, lying.freeze)
        play(world, [(state, volts, freeze)])
        assert outcome(world)[0] == "tripped"
        assert "the telemetry of motor is frozen" in outcome(world)[1]
        assert zero_after(world, at[0]) <= 0.1 + 0.04


def test_telemetry_that_froze_at_rest_confirms_no_rest(tmp_path):
    """The row says 0 rev/s all the while: the motor seems not to follow, and its 0 is not believed afterwards."""
    with virtual(tmp_path) as world:
        lying = Telemetry(world)
        play(world, [("tare", 0.0, lying.freeze)])
        assert outcome(world)[0] == "tripped"
        assert "the motor does not follow" in outcome(world)[1]
        assert sum(abs(volts) >= 4.0 for _, volts in world.motor.sent) <= 1.0 / 0.02 + 2, "commands, one every 0.02 s"
        assert world.session.status.stop_confirmed is False


def test_a_motor_that_does_nothing(tmp_path):
    with virtual(tmp_path) as world:
        Telemetry(world)
        world.motor.ignores = True
        play(world)
        assert outcome(world)[0] == "tripped"
        assert "the motor does not follow" in outcome(world)[1]
        assert world.session.status.stop_confirmed is True, "its telemetry lives, and the thrust says the same"


def test_a_motor_that_starts_by_itself(tmp_path):
    with virtual(tmp_path) as world:
        Telemetry(world)

        def redrive() -> None:
            world.motor.ignores, world.motor.volts, world.motor.timeout = True, 5.0, None

        at, start = when(world, redrive)
        seen = []

        def each(now: float) -> None:
            output = world.session.status.output
            if not at and output is not None and output.state == "tare" and output.step_elapsed > 0.3 and output.step:
                seen.append(now)
                start()

        play(world, each=each)
        assert outcome(world)[0] == "tripped"
        assert "the propeller turns by itself" in outcome(world)[1]
        assert world.motor.released > 10, "the second way is tried"
        assert world.session.status.stop_confirmed is False
        said = next(event.time for event in world.recorder.events if "turns by itself" in event.text)
        assert said + 1.0 - at[0] < 0.6, "t = 0 is about a second after the clock's"


def test_a_propeller_that_runs_backwards(tmp_path):
    """From the second hold on; which way round it is wired is learnt in the first."""
    with virtual(tmp_path, plan=LONG) as world:
        lying = Telemetry(world)

        def turned_round() -> None:
            lying.lie = lambda row: (abs(row[0]), row[1])

        at, turn = when(world, turned_round)
        play(world, [("hold", -6.0, turn)])
        assert outcome(world)[0] == "tripped"
        assert "the propeller runs backwards" in outcome(world)[1]
        assert zero_after(world, at[0]) <= 1.0 + 0.1


def test_a_motor_wired_the_other_way_round_is_no_fault(tmp_path):
    with virtual(tmp_path, plan=LONG) as world:
        Telemetry(world, lie=lambda row: (-row[0], row[1]))
        play(world)
        assert outcome(world) == ("completed", "")


def test_rest_that_the_thrust_contradicts_is_not_confirmed(tmp_path):
    """The motor ignores the stop, and its rows say 0 with lively noise."""
    with virtual(tmp_path, plan=LONG) as world:
        lying = Telemetry(world)

        def lie() -> None:
            world.motor.ignores, world.motor.timeout = True, None
            lying.lie = lambda row: (0.001 * row[1], row[1])
            world.session.loop.signals.append(Request("stop", "a test"))

        play(world, [("hold", -6.0, lie)])
        assert outcome(world)[0] == "aborted"
        assert world.session.status.stop_confirmed is False
        assert "STOP NOT CONFIRMED" in world.texts
        assert "the thrust is not back at its tare" in world.texts
        assert min(abs(rate) for time, rate in lying.truth[-100:]) > 5.0


def test_rest_without_a_tare_says_on_what_it_rests(tmp_path):
    with virtual(tmp_path, prove_watchdog=True) as world:
        Telemetry(world)
        play(world, [("proving", 4.0, lambda: world.session.loop.signals.append(Request("stop", "a test")))])
        assert world.session.status.stop_confirmed is True
        assert "by its rotation rate alone: the thrust is no witness" in world.texts
